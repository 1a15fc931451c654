#include "host/base/number.h"
#include "host/cli/cli.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

int cli_choice(const char *choices, const char *word) {
    size_t length = strlen(word);
    for (int index = 0;; ++index) {
        size_t n = strcspn(choices, "|");
        if (n == length && memcmp(choices, word, n) == 0) return index;
        if (choices[n] == '\0') return -1;
        choices += n + 1;
    }
}

bool cli_real_read(const char *text, double *value) {
    const char *end = qp_read_double(text, text + strlen(text), value);
    return end != NULL && *end == '\0';
}

bool cli_count_read(const char *text, uint64_t *value) {
    /* strtoull would take a sign and blanks. */
    if (text[0] < '0' || text[0] > '9') return false;
    char *end;
    errno = 0;
    unsigned long long n = strtoull(text, &end, 10);
    *value = n;
    return *end == '\0' && errno == 0;
}

bool cli_sizes_read(const char *text, cli_sizes *sizes) {
    *sizes = (cli_sizes){0};
    while (sizes->count < 3) {
        if (*text < '0' || *text > '9') return false;
        char *end;
        errno = 0;
        unsigned long long n = strtoull(text, &end, 10);
        if (errno != 0 || n > 0x80000000ull) return false;
        sizes->n[sizes->count++] = (uint32_t)n;
        if (*end == '\0') return true;
        if (*end != 'x') return false;
        text = end + 1;
    }
    return false;
}

/* The number of bytes at *text, which is moved behind it. */
static bool read_bytes(const char **text, uint64_t *value) {
    static const char suffixes[] = "KMGT";
    if (**text < '0' || **text > '9') return false;
    char *end;
    errno = 0;
    unsigned long long n = strtoull(*text, &end, 10);
    if (errno != 0) return false;
    const char *suffix = *end == '\0' ? NULL : strchr(suffixes, *end);
    const unsigned shift = suffix == NULL ? 0 : 10u * (unsigned)(suffix - suffixes + 1);
    if (n > UINT64_MAX >> shift) return false;
    *value = (uint64_t)n << shift;
    *text = suffix == NULL ? end : end + 1;
    return true;
}

bool cli_bytes_read(const char *text, uint64_t *value) {
    return read_bytes(&text, value) && *text == '\0';
}

bool cli_byte_range_read(const char *text, cli_byte_range *range) {
    if (!read_bytes(&text, &range->first)) return false;
    range->last = range->first;
    if (*text == '\0') return true;
    if (strncmp(text, "..", 2) != 0) return false;
    text += 2;
    return read_bytes(&text, &range->last) && *text == '\0' && range->first <= range->last;
}

static void print_help(const cli_command *command, const cli_option *options) {
    printf("usage: quadplan %s [options] %s\n%s\n", command->name, command->arguments, command->summary);
    if (command->details != NULL) printf("\n%s\n", command->details);
    printf("\noptions:\n");
    for (const cli_option *o = options; o->name != NULL; ++o) {
        int width = printf("  %s%s%s", o->name, o->argument != NULL ? " " : "",
                           o->argument != NULL ? o->argument : "");
        if (width > 30) {
            printf("\n");
            width = 0;
        }
        printf("%*s%s\n", 32 - width, "", o->help);
    }
    printf("%-32s%s\n", "  --help", "this text");
}

static qp_status set_value(const cli_option *o, const char *text, qp_error *err) {
    switch (o->kind) {
    case CLI_FLAG:
        *(bool *)o->value = true;
        break;
    case CLI_TEXT:
        *(const char **)o->value = text;
        break;
    case CLI_COUNT: {
        uint64_t n;
        if (!cli_count_read(text, &n) || (double)n < o->low || (double)n > o->high)
            return qp_fail(err, QP_BAD_INPUT, "%s: '%s' is not a whole number from %.0f to %.0f", o->name,
                           text, o->low, o->high);
        *(uint64_t *)o->value = n;
        break;
    }
    case CLI_BYTES: {
        uint64_t n;
        if (!cli_bytes_read(text, &n) || (double)n < o->low || (double)n > o->high)
            return qp_fail(
                err, QP_BAD_INPUT,
                "%s: '%s' is not a number of bytes from %.0f to %.0f (64K, 1M, 2G are 2^10, 2^20, 2^30)",
                o->name, text, o->low, o->high);
        *(uint64_t *)o->value = n;
        break;
    }
    case CLI_BYTE_RANGE: {
        cli_byte_range range;
        if (!cli_byte_range_read(text, &range) || (double)range.first < o->low ||
            (double)range.last > o->high)
            return qp_fail(err, QP_BAD_INPUT, "%s: '%s' is not of the form 64K..32M, from %.0f to %.0f bytes",
                           o->name, text, o->low, o->high);
        *(cli_byte_range *)o->value = range;
        break;
    }
    case CLI_REAL: {
        double x;
        if (!cli_real_read(text, &x) || x < o->low || x > o->high)
            return qp_fail(err, QP_BAD_INPUT, "%s: '%s' is not a number from %g to %g", o->name, text, o->low,
                           o->high);
        *(double *)o->value = x;
        break;
    }
    case CLI_CHOICE: {
        int index = cli_choice(o->argument, text);
        if (index < 0)
            return qp_fail(err, QP_BAD_INPUT, "%s: '%s' is none of %s", o->name, text, o->argument);
        *(int *)o->value = index;
        break;
    }
    case CLI_SIZES:
        if (!cli_sizes_read(text, o->value))
            return qp_fail(err, QP_BAD_INPUT, "%s: '%s' is not of the form %s", o->name, text, o->argument);
        break;
    }
    if (o->given != NULL) *o->given = true;
    return QP_OK;
}

/* The option that argv's word names; *text is what follows "=" in it, or NULL. */
static const cli_option *find_option(const cli_option *options, const char *word, const char **text) {
    size_t length = strcspn(word, "=");
    *text = word[length] == '=' ? word + length + 1 : NULL;
    for (const cli_option *o = options; o->name != NULL; ++o) {
        if (strlen(o->name) == length && memcmp(o->name, word, length) == 0) return o;
    }
    return NULL;
}

qp_status cli_parse(const cli_command *command, const cli_option *options, int argc, char **argv,
                    int expected, cli_arguments *arguments, qp_error *err) {
    *arguments = (cli_arguments){0};
    bool no_more_options = false;
    for (int i = 1; i < argc; ++i) {
        const char *word = argv[i];
        if (no_more_options || word[0] != '-' || word[1] == '\0') {
            if (arguments->count >= expected)
                return qp_fail(err, QP_BAD_INPUT, "unexpected argument '%s'; see `quadplan %s --help`", word,
                               command->name);
            arguments->values[arguments->count++] = word;
            continue;
        }
        if (strcmp(word, "--") == 0) {
            no_more_options = true;
            continue;
        }
        if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
            print_help(command, options);
            arguments->help = true;
            return QP_OK;
        }
        const char *text;
        const cli_option *o = find_option(options, word, &text);
        if (o == NULL)
            return qp_fail(err, QP_BAD_INPUT, "unknown option '%s'; see `quadplan %s --help`", word,
                           command->name);
        if (o->kind == CLI_FLAG && text != NULL)
            return qp_fail(err, QP_BAD_INPUT, "%s takes no value", o->name);
        if (o->kind != CLI_FLAG && text == NULL) {
            if (i + 1 == argc)
                return qp_fail(err, QP_BAD_INPUT, "%s needs a value: %s", o->name, o->argument);
            text = argv[++i];
        }
        qp_status status = set_value(o, text, err);
        if (status != QP_OK) return status;
    }
    if (arguments->count < expected)
        return qp_fail(err, QP_BAD_INPUT, "%s is missing; see `quadplan %s --help`", command->arguments,
                       command->name);
    return QP_OK;
}
