/* Runs a fuzz target without libFuzzer, the same on every machine and with every compiler:
 *
 *   fuzz_NAME CORPUS_FOLDER [COUNT [SEED]]   every file of the corpus, then COUNT mutations of them (10000)
 *   fuzz_NAME FILE                           that file only
 *
 * Mutation i depends on the corpus, the seed and i only. The input at hand is kept in fuzz_NAME.last, which remains
 * when the target crashes, hangs (30 seconds) or is killed by a sanitizer. */
#define _GNU_SOURCE
#include "host/base/random.h"
#include "host/base/status.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

typedef struct input {
    char *name;
    uint8_t *bytes;
    size_t size;
} input;

enum { LARGEST = 1 << 16, SECONDS = 30 };

static input *corpus;
static size_t corpus_count;

static void die(const char *what, const char *which) {
    fprintf(stderr, "fuzz: %s %s\n", what, which);
    exit(3);
}

static input read_input(const char *path) {
    input in = {.name = strdup(path), .bytes = malloc(LARGEST)};
    FILE *file = fopen(path, "rb");
    if (in.name == NULL || in.bytes == NULL || file == NULL) die("cannot read", path);
    in.size = fread(in.bytes, 1, LARGEST, file);
    fclose(file);
    return in;
}

static int by_name(const void *a, const void *b) {
    return strcmp(((const input *)a)->name, ((const input *)b)->name);
}

static void read_corpus(const char *folder) {
    DIR *entries = opendir(folder);
    size_t capacity = 0;
    void *block = NULL;
    if (entries == NULL) die("cannot open", folder);
    for (struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        if (entry->d_name[0] == '.') continue;
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (!qp_grow(&block, &capacity, corpus_count + 1, sizeof *corpus)) die("out of memory:", folder);
        corpus = block;
        corpus[corpus_count++] = read_input(path);
    }
    closedir(entries);
    if (corpus_count == 0) die("no files in", folder);
    qsort(corpus, corpus_count, sizeof *corpus, by_name); /* the folder's order is not the same everywhere */
}

/* ---- Mutations of bytes[0, size), which has room for LARGEST; each returns the new size ---- */

static size_t replace_range(uint8_t *bytes, size_t size, size_t at, size_t removed, const void *with,
                            size_t length) {
    if (size - removed + length > LARGEST) return size;
    memmove(bytes + at + length, bytes + at + removed, size - at - removed);
    memcpy(bytes + at, with, length);
    return size - removed + length;
}

static size_t pick(qp_random *random, size_t limit) {
    return limit == 0 ? 0 : qp_random_below(random, (uint32_t)limit);
}

static size_t flip_bytes(qp_random *random, uint8_t *bytes, size_t size) {
    for (size_t i = 1 + pick(random, 4); size > 0 && i > 0; --i) {
        uint8_t *b = &bytes[pick(random, size)];
        *b = qp_random_chance(random, 0.5) ? (uint8_t)(*b ^ (1u << pick(random, 8)))
                                           : (uint8_t)pick(random, 256);
    }
    return size;
}

static size_t truncate_tail(qp_random *random, uint8_t *bytes, size_t size) {
    (void)bytes;
    return pick(random, size + 1);
}

/* A piece of some corpus file into, or over, a place in this one. */
static size_t splice(qp_random *random, uint8_t *bytes, size_t size) {
    const input *from = &corpus[pick(random, corpus_count)];
    const size_t start = pick(random, from->size), length = 1 + pick(random, from->size - start);
    const size_t at = pick(random, size + 1),
                 over = qp_random_chance(random, 0.5) ? 0 : pick(random, size - at + 1);
    if (from->size == 0) return size;
    return replace_range(bytes, size, at, over, from->bytes + start, length);
}

static size_t remove_range(qp_random *random, uint8_t *bytes, size_t size) {
    const size_t at = pick(random, size), length = pick(random, size - at + 1);
    return replace_range(bytes, size, at, length, "", 0);
}

/* Copies or removes one whole line. */
static size_t edit_line(qp_random *random, uint8_t *bytes, size_t size) {
    uint8_t line[512];
    size_t begin = pick(random, size), end = begin;
    while (begin > 0 && bytes[begin - 1] != '\n') --begin;
    while (end < size && bytes[end] != '\n') ++end;
    if (end < size) ++end;
    if (end - begin > sizeof line) return size;
    memcpy(line, bytes + begin, end - begin);
    if (qp_random_chance(random, 0.5)) return replace_range(bytes, size, begin, end - begin, "", 0);
    size_t at = pick(random, size + 1);
    while (at > 0 && bytes[at - 1] != '\n') --at;
    return replace_range(bytes, size, at, 0, line, end - begin);
}

/* Another number in place of one that is there. */
static size_t edit_number(qp_random *random, uint8_t *bytes, size_t size) {
    static const char *const odd[] = {"0",          "-1",
                                      "1",          "2147483647",
                                      "2147483648", "-2147483648",
                                      "1e39",       "4294967295",
                                      "1e309",      "nan",
                                      "inf",        "-0",
                                      "0x1p3",      "18446744073709551616",
                                      "1e-320",     "0.5",
                                      "10",         "9.9999",
                                      "1,5",        ""};
    char text[32];
    size_t begin = pick(random, size), end;
    while (begin < size && !(bytes[begin] >= '0' && bytes[begin] <= '9')) ++begin;
    end = begin;
    while (end < size && bytes[end] >= '0' && bytes[end] <= '9') ++end;
    if (begin == end) return size;
    if (qp_random_chance(random, 0.5)) {
        snprintf(text, sizeof text, "%s", odd[pick(random, sizeof odd / sizeof odd[0])]);
    } else {
        snprintf(text, sizeof text, "%d", (int)pick(random, 40) - 4);
    }
    return replace_range(bytes, size, begin, end - begin, text, strlen(text));
}

static size_t mutate(qp_random *random, uint8_t *bytes, size_t size) {
    static size_t (*const mutations[])(qp_random *, uint8_t *, size_t) = {
        flip_bytes, truncate_tail, splice,      remove_range, edit_line,
        edit_line,  edit_number,   edit_number, edit_number};
    for (size_t i = 1 + pick(random, 4); i > 0; --i) {
        size = mutations[pick(random, sizeof mutations / sizeof mutations[0])](random, bytes, size);
    }
    return size;
}

/* ---- Running ---- */

static FILE *last_file;

/* The target gets a block of the exact size, so that a sanitizer sees any reading past its end. */
static void run_input(const uint8_t *bytes, size_t size) {
    uint8_t *copy = malloc(size == 0 ? 1 : size);
    if (copy == NULL) die("out of memory", "");
    memcpy(copy, bytes, size);
    rewind(last_file);
    if (ftruncate(fileno(last_file), 0) != 0 || fwrite(bytes, 1, size, last_file) != size ||
        fflush(last_file) != 0) {
        die("cannot write", "the input at hand");
    }
    alarm(SECONDS);
    LLVMFuzzerTestOneInput(copy, size);
    alarm(0);
    free(copy);
}

static void run_mutations(unsigned long count, uint64_t seed) {
    uint8_t *bytes = malloc(LARGEST);
    if (bytes == NULL) die("out of memory", "");
    for (unsigned long i = 0; i < count; ++i) {
        qp_random random = {seed * UINT64_C(0x100000001) + i};
        qp_random_bits(&random);
        const input *from = &corpus[pick(&random, corpus_count)];
        memcpy(bytes, from->bytes, from->size);
        const size_t size = mutate(&random, bytes, from->size);
        run_input(bytes, size);
    }
    free(bytes);
}

int main(int argc, char **argv) {
    struct stat about;
    char last_path[256];
    if (argc < 2 || argc > 4) {
        fprintf(stderr, "usage: %s CORPUS_FOLDER [COUNT [SEED]] | FILE\n", argv[0]);
        return 2;
    }
    const char *slash = strrchr(argv[0], '/');
    snprintf(last_path, sizeof last_path, "%s.last", slash != NULL ? slash + 1 : argv[0]);
    last_file = fopen(last_path, "wb");
    if (last_file == NULL) die("cannot write", last_path);
    if (stat(argv[1], &about) != 0) die("cannot find", argv[1]);
    const unsigned long count = argc > 2 ? strtoul(argv[2], NULL, 10) : 10000;
    if (S_ISDIR(about.st_mode)) {
        read_corpus(argv[1]);
        for (size_t i = 0; i < corpus_count; ++i) run_input(corpus[i].bytes, corpus[i].size);
        run_mutations(count, argc > 3 ? strtoull(argv[3], NULL, 10) : 1);
        printf("%zu files and %lu mutations of them\n", corpus_count, count);
    } else {
        input in = read_input(argv[1]);
        run_input(in.bytes, in.size);
        free(in.name);
        free(in.bytes);
    }
    for (size_t i = 0; i < corpus_count; ++i) {
        free(corpus[i].name);
        free(corpus[i].bytes);
    }
    free(corpus);
    fclose(last_file);
    remove(last_path);
    return 0;
}
