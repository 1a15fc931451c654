/* Numbers in text: right to the last bit, with any locale, and nothing else taken for a number. */
#include "host/base/number.h"
#include "host/base/random.h"
#include "tests/check.h"

#include <locale.h>
#include <string.h>

static void check_read(const char *text, double expected) {
    double value = 0;
    const char *end = text + strlen(text);
    if (!CHECK(qp_read_double(text, end, &value) == end) ||
        !CHECK(memcmp(&value, &expected, sizeof value) == 0)) {
        fprintf(stderr, "    %s gives %.17g\n", text, value);
    }
}

/* Every reading must be strtod's, bit for bit, which is correctly rounded in glibc. Run in the C locale. */
static void check_random(void) {
    qp_random random = {7};
    for (int i = 0; i < 300000; ++i) {
        char text[64];
        double value;
        if (i % 3 == 0) {
            uint64_t bits = qp_random_bits(&random);
            memcpy(&value, &bits, sizeof value);
            if (!isfinite(value)) continue;
            snprintf(text, sizeof text, "%.*g", 1 + (int)qp_random_below(&random, 19), value);
        } else {
            const int exponent = (int)qp_random_below(&random, 60) - 30;
            snprintf(text, sizeof text, "%llu.%llue%d", (unsigned long long)qp_random_below(&random, 1000),
                     (unsigned long long)(qp_random_bits(&random) >> qp_random_below(&random, 64)), exponent);
        }
        const double expected = strtod(text, NULL);
        if (isfinite(expected)) check_read(text, expected);
    }
}

/* Halfway between two doubles, and a hair off: where rounding twice goes wrong. */
static void check_halfway(void) {
    check_read("9007199254740993", 9007199254740992.0);
    check_read("9007199254740995", 9007199254740996.0);
    check_read("9007199254740993.00000000001", 9007199254740994.0);
    check_read("1.00000000000000011102230246251565404236316680908203125", 1.0);
    check_read("1.00000000000000011102230246251565404236316680908203126", 1.0 + 0x1p-52);
    check_read("4.9e-324", 0x1p-1074);
    check_read("2.4e-324", 0);
    check_read("1e-400", 0);
    check_read("0e999999999", 0);
    check_read("-0", -0.0);
    check_read("1.7976931348623157e308", 0x1.fffffffffffffp1023);
    check_read("0000000000000000000000000000000001.5", 1.5);
    check_read("0.00000000000000000000000000000000015", 1.5e-34);
}

static void check_refused(void) {
    static const char *const bad[] = {"",    "-",   ".",   "+.",    "e5",     "1e",
                                      "1e+", "nan", "inf", "1e309", "-1e999", "x"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        double value;
        if (!CHECK(qp_read_double(bad[i], bad[i] + strlen(bad[i]), &value) == NULL)) {
            fprintf(stderr, "    \"%s\"\n", bad[i]);
        }
    }
    char digits[3000];
    double value;
    memset(digits, '1', sizeof digits);
    CHECK(qp_read_double(digits, digits + sizeof digits, &value) == NULL);
    /* Nothing is read past the end. */
    const char text[] = "12345";
    CHECK(qp_read_double(text, text + 2, &value) == text + 2 && value == 12);
    int64_t n;
    CHECK(qp_read_int64(text, text + 3, &n) == text + 3 && n == 123);
    const char large[] = "99999999999999999999";
    CHECK(qp_read_int64(large, large + sizeof large - 1, &n) == NULL);
    const char negative[] = "-42/";
    CHECK(qp_read_int64(negative, negative + 4, &n) == negative + 3 && n == -42);
    CHECK(qp_read_int64(negative, negative + 1, &n) == NULL);
}

static void check_write(void) {
    qp_random random = {3};
    char text[QP_NUMBER_CHARS];
    CHECK(qp_write_double(text, 0.1) == 3 && strcmp(text, "0.1") == 0);
    CHECK(qp_write_double(text, -1e22) > 0 && strcmp(text, "-1e+22") == 0);
    CHECK(qp_write_float(text, 0.1f) == 3 && strcmp(text, "0.1") == 0);
    CHECK(qp_write_float(text, 4.7f) == 3 && strcmp(text, "4.7") == 0);
    for (int i = 0; i < 100000; ++i) {
        const uint64_t bits = qp_random_bits(&random);
        double value, back;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value)) continue;
        const size_t length = qp_write_double(text, value);
        CHECK(qp_read_double(text, text + length, &back) == text + length && memcmp(&back, &value, 8) == 0);
    }
}

int main(void) {
    check_random();
    check_halfway();
    check_refused();
    check_write();
    /* With a decimal comma, if the machine has such a locale: the same. */
    static const char *const commas[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "ru_RU.UTF-8"};
    for (size_t i = 0; i < sizeof commas / sizeof commas[0]; ++i) {
        if (setlocale(LC_ALL, commas[i]) == NULL) continue;
        printf("again with locale %s\n", commas[i]);
        check_halfway();
        check_write();
        break;
    }
    return check_report();
}
