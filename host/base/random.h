/* Small deterministic random numbers, the same on every machine: splitmix64 (Steele, Lea, Flood 2014). */
#ifndef QP_BASE_RANDOM_H
#define QP_BASE_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

typedef struct qp_random {
    uint64_t state; /* any value is a good seed */
} qp_random;

static inline uint64_t qp_random_bits(qp_random *random) {
    uint64_t z = random->state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

/* In [0, limit); limit at least 1. Bias below limit / 2^32. */
static inline uint32_t qp_random_below(qp_random *random, uint32_t limit) {
    return (uint32_t)(((qp_random_bits(random) >> 32) * limit) >> 32);
}

/* In [0, 1), a multiple of 2^-53. */
static inline double qp_random_unit(qp_random *random) {
    return (double)(qp_random_bits(random) >> 11) * 0x1p-53;
}

static inline bool qp_random_chance(qp_random *random, double probability) {
    return qp_random_unit(random) < probability;
}

#endif
