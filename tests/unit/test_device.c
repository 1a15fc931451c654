/* Which device is meant: the default does not depend on the order in which drivers are found. */
#include "host/device/device.h"
#include "tests/check.h"

#include <string.h>

static qp_device_info device(const char *id, const char *platform, const char *name, bool has_double,
                             bool is_cpu, bool rounds) {
    qp_device_info info = {.has_double = has_double, .is_cpu = is_cpu, .rounds_correctly = rounds};
    snprintf(info.id, sizeof info.id, "%s", id);
    snprintf(info.platform, sizeof info.platform, "%s", platform);
    snprintf(info.name, sizeof info.name, "%s", name);
    return info;
}

/* The id of the device that `which` means in the list, or "none". */
static const char *chosen(const qp_device_info *list, size_t n, const char *which) {
    const size_t i = qp_device_choose(list, n, which);
    return i < n ? list[i].id : "none";
}

int main(void) {
    const qp_device_info pocl = device("2.0", "Portable Computing Language", "pthread-AMD", true, true, true),
                         pocl_gpu = device("3.0", "Portable Computing Language", "CUDA", true, false, true),
                         mesa = device("0.0", "rusticl", "llvmpipe", false, true, false),
                         intel = device("1.0", "Intel(R) OpenCL", "AMD EPYC", true, true, false),
                         gpu = device("4.0", "NVIDIA CUDA", "NVIDIA H200", true, false, true);
    const qp_device_info all[] = {mesa, intel, pocl_gpu, gpu, pocl};
    CHECK(strcmp(chosen(all, 5, ""), "2.0") == 0);
    CHECK(strcmp(chosen(all, 4, ""), "3.0") == 0);
    CHECK(strcmp(chosen(all, 2, ""), "1.0") == 0);
    CHECK(strcmp(chosen(all, 1, ""), "0.0") == 0);
    CHECK(strcmp(chosen(all, 0, ""), "none") == 0);
    for (int turn = 0; turn < 5; ++turn) {
        qp_device_info turned[5];
        for (int i = 0; i < 5; ++i) turned[i] = all[(i + turn) % 5];
        CHECK(strcmp(chosen(turned, 5, ""), "2.0") == 0);
        CHECK(strcmp(chosen(turned, 5, "0.0"), "0.0") == 0);
        CHECK(strcmp(chosen(turned, 5, "h200"), "4.0") == 0);
        CHECK(strcmp(chosen(turned, 5, "9.9"), "none") == 0);
    }
    /* An id comes before a name that holds it. */
    const qp_device_info named[] = {device("0.0", "a", "version 1.0", true, true, true),
                                    device("1.0", "b", "other", true, true, true)};
    CHECK(strcmp(chosen(named, 2, "1.0"), "1.0") == 0);
    return check_report();
}
