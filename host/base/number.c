#define _GNU_SOURCE
#include "host/base/number.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBER_LIMIT = 1000 };

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/* strtod of a NUL-terminated number in the C locale, made once and kept for the life of the process. */
static locale_t c_locale;
static pthread_once_t c_locale_once = PTHREAD_ONCE_INIT;
static void make_c_locale(void) {
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

static bool read_exactly(const char *text, size_t length, double *value) {
    char copy[NUMBER_LIMIT + 1];
    memcpy(copy, text, length);
    copy[length] = '\0';
    pthread_once(&c_locale_once, make_c_locale);
    *value = c_locale != (locale_t)0 ? strtod_l(copy, NULL, c_locale) : strtod(copy, NULL);
    return isfinite(*value);
}

/* mantissa * 10^exponent when one correctly rounded operation settles it: 10^k is exact in a double to k =
 * 22, and in a long double of 64 bits to k = 27. The latter is rounded twice; that is right unless its
 * neighbours round to different doubles, which is tested. */
static bool scale_fast(uint64_t mantissa, int exponent, double *value) {
    static const double tens[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                  1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (mantissa == 0) {
        *value = 0;
        return true;
    }
    if (exponent < -22 || exponent > 22) return false;
    double ten = tens[exponent < 0 ? -exponent : exponent];
    if (mantissa <= UINT64_C(1) << 53) {
        *value = exponent < 0 ? (double)mantissa / ten : (double)mantissa * ten;
        return true;
    }
#if LDBL_MANT_DIG >= 64
    long double wide = exponent < 0 ? (long double)mantissa / ten : (long double)mantissa * ten;
    long double slack = wide * 0x1p-63L;
    *value = (double)wide;
    return (double)(wide - slack) == *value && (double)(wide + slack) == *value;
#else
    return false;
#endif
}

const char *qp_read_double(const char *text, const char *end, double *value) {
    const char *p = text;
    bool negative = false;
    if (p < end && (*p == '-' || *p == '+')) negative = *p++ == '-';
    uint64_t mantissa = 0;
    int digits = 0, exponent = 0;
    bool any = false, exact = true;
    for (int point = 0; p < end; ++p) {
        if (*p == '.' && point == 0) {
            point = 1;
        } else if (is_digit(*p)) {
            any = true;
            if (p - text > NUMBER_LIMIT) return NULL;
            if (digits < 19) {
                mantissa = mantissa * 10 + (uint64_t)(*p - '0');
                digits += mantissa != 0;
                exponent -= point;
            } else {
                exact = false;
                exponent += !point;
            }
        } else {
            break;
        }
    }
    if (!any) return NULL;
    if (p < end && (*p == 'e' || *p == 'E')) {
        const char *q = p + 1;
        bool down = false;
        if (q < end && (*q == '-' || *q == '+')) down = *q++ == '-';
        if (q == end || !is_digit(*q)) return NULL;
        int e = 0;
        for (; q < end && is_digit(*q); ++q) {
            if (e < 100000) e = e * 10 + (*q - '0');
        }
        exponent += down ? -e : e;
        p = q;
    }
    if (p - text > NUMBER_LIMIT) return NULL;
    if (exact && scale_fast(mantissa, exponent, value)) {
        if (negative) *value = -*value;
        return p;
    }
    return read_exactly(text, (size_t)(p - text), value) ? p : NULL;
}

const char *qp_read_int64(const char *text, const char *end, int64_t *value) {
    const char *p = text;
    bool negative = false;
    if (p < end && (*p == '-' || *p == '+')) negative = *p++ == '-';
    if (p == end || !is_digit(*p)) return NULL;
    int64_t n = 0;
    for (; p < end && is_digit(*p); ++p) {
        if (n > (INT64_MAX - 9) / 10) return NULL;
        n = n * 10 + (*p - '0');
    }
    *value = negative ? -n : n;
    return p;
}

/* printf's decimal point is the locale's, and may be several bytes: whatever is no part of a number becomes
 * one point. */
static size_t use_point(char *text) {
    size_t out = 0;
    bool in_point = false;
    for (const char *p = text; *p != '\0'; ++p) {
        if (is_digit(*p) || *p == '-' || *p == '+' || *p == 'e') {
            text[out++] = *p;
            in_point = false;
        } else if (!in_point) {
            text[out++] = '.';
            in_point = true;
        }
    }
    text[out] = '\0';
    return out;
}

size_t qp_write_double(char text[QP_NUMBER_CHARS], double value) {
    size_t length = 0;
    for (int digits = 15; digits <= 17; ++digits) {
        snprintf(text, QP_NUMBER_CHARS, "%.*g", digits, value);
        length = use_point(text);
        double back;
        if (qp_read_double(text, text + length, &back) != NULL && back == value) break;
    }
    return length;
}

size_t qp_write_float(char text[QP_NUMBER_CHARS], float value) {
    size_t length = 0;
    for (int digits = 6; digits <= 9; ++digits) {
        snprintf(text, QP_NUMBER_CHARS, "%.*g", digits, (double)value);
        length = use_point(text);
        double back;
        if (qp_read_double(text, text + length, &back) != NULL && (float)back == value) break;
    }
    return length;
}
