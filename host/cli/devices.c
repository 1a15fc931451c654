/* quadplan devices: what can evaluate. */
#include "host/cli/cli.h"
#include "host/device/device.h"

#include <inttypes.h>
#include <stdlib.h>

static void print_json(const qp_device_info *list, size_t count) {
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_open_array(&json, "devices");
    for (size_t i = 0; i < count; ++i) {
        qp_json_open_object(&json, NULL);
        qp_json_text(&json, "id", list[i].id);
        qp_json_text(&json, "name", list[i].name);
        qp_json_text(&json, "platform", list[i].platform);
        qp_json_text(&json, "version", list[i].version);
        qp_json_bool(&json, "double", list[i].has_double);
        qp_json_bool(&json, "cpu", list[i].is_cpu);
        qp_json_bool(&json, "rounds_correctly", list[i].rounds_correctly);
        qp_json_integer(&json, "compute_units", list[i].compute_units);
        qp_json_integer(&json, "memory_bytes", list[i].memory_bytes);
        qp_json_close(&json);
    }
    qp_json_finish(&json);
}

static void print_text(const qp_device_info *list, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const qp_device_info *d = &list[i];
        printf("%-5s %s\n      %s, %s\n      %" PRIu32 " compute units, %.1f GiB, float%s%s\n", d->id,
               d->name, d->platform, d->version, d->compute_units, (double)d->memory_bytes / 0x1p30,
               d->has_double ? " and double" : "",
               d->rounds_correctly ? "" : "; its float division is not correctly rounded");
    }
}

static qp_status run(int argc, char **argv, qp_error *err) {
    bool json = false;
    const cli_option options[] = {
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_devices, options, argc, argv, 0, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    qp_device_info *list = NULL;
    size_t count = 0;
    status = qp_device_list(&list, &count, err);
    if (status != QP_OK) return status;
    if (json) {
        print_json(list, count);
    } else {
        print_text(list, count);
    }
    free(list);
    return QP_OK;
}

const cli_command cli_devices = {
    "devices", "", "Lists the devices that can evaluate.",
    "Each has the id that --device takes; \"host\" is the kernels compiled as C into the program.", run};
