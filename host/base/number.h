/* Numbers in text, whatever the locale: correctly rounded reading, shortest exact writing. */
#ifndef QP_BASE_NUMBER_H
#define QP_BASE_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Reads [sign] digits [. digits] [e [sign] digits] from [text, end) into *value, rounded to the nearest
 * double. Returns the place after the number, or NULL when there is no number there, when it is longer than
 * 1000 characters, or when it overflows a double. Words such as "nan" and "inf" and hexadecimal are no
 * numbers. */
const char *qp_read_double(const char *text, const char *end, double *value);

/* Reads [sign] digits. NULL when there is no integer there or it does not fit. */
const char *qp_read_int64(const char *text, const char *end, int64_t *value);

/* Space that qp_write_double needs, terminating NUL included. */
enum { QP_NUMBER_CHARS = 32 };

/* Writes a finite value with the fewest of 15, 16, 17 significant digits that read back to the same double,
 * with a decimal point whatever the locale. Returns the number of characters before the NUL. */
size_t qp_write_double(char text[QP_NUMBER_CHARS], double value);

/* The same for a float: the fewest of 6 to 9 digits that read back to the same float. */
size_t qp_write_float(char text[QP_NUMBER_CHARS], float value);

#endif
