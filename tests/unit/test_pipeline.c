/* The model of a tessellation pipeline: cases with a closed form, what must hold in any case, and random cases beside a simulator that
 * goes tick by tick over every patch and every point of the ring. */
#include "host/base/random.h"
#include "host/frame/frame.h"
#include "host/frame/pipeline.h"
#include "tests/check.h"

#include <string.h>

enum { MOST = 200, MOST_SMS = 4, POINT = 16 };

/* One SM, rates such that a patch of p points, ring 1 and s samples is alone for p cycles in its hull and s in its domain stage. */
static qp_machine plain(uint32_t sms, uint32_t warps, bool out_of_order) {
    return (qp_machine){.sms = sms,
                        .warps = warps,
                        .point_bytes = POINT,
                        .hull_rate = warps,
                        .domain_rate = warps,
                        .out_of_order = out_of_order};
}

static qp_pipeline_result run(const qp_patch_work *work, size_t count, const qp_machine *machine,
                              uint64_t ring_points, qp_patch_times *times) {
    qp_pipeline_result result;
    qp_error err = {0};
    CHECK_OK(qp_pipeline_run(work, count, machine, ring_points * POINT, &result, times, &err), err);
    return result;
}

static void set_all(qp_patch_work *work, size_t count, uint32_t points, uint32_t samples) {
    for (size_t i = 0; i < count; ++i) work[i] = (qp_patch_work){(uint32_t)i, points, 1, samples};
}

/* ---- Closed forms ---- */

static void one_slot_adds_up(void) {
    const qp_patch_work work[] = {{0, 10, 3, 7}, {1, 4, 5, 9}, {2, 0, 16, 25}, {3, 8, 2, 1}};
    for (int order = 0; order < 2; ++order) {
        qp_machine m = plain(1, 1, order == 1);
        m.hull_rate = 2;
        m.domain_rate = 0.25;
        m.tessellator_rate = 0.5;
        m.latency = 100;
        /* hull 15 + 10 + 8, tessellator 2 and domain 4 a sample, latency for those that have a hull */
        const double expected = 33 + 6 * (7 + 9 + 25 + 1) + 300;
        CHECK(run(work, 4, &m, 0, NULL).cycles == expected);
        const qp_pipeline_result r = run(work, 4, &m, 10, NULL);
        CHECK(r.cycles == expected && r.stall_cycles == 0 && r.stalls == 0);
        CHECK(r.occupancy == 1 && r.in_flight == 1 && r.allocations == 3);
        CHECK(r.peak_bytes == 10 * POINT && r.allocated_bytes == 22 * POINT);
    }
}

/* Equal patches on N slots take turns; a ring for k of them is a machine with k slots. */
static void equal_patches(void) {
    qp_patch_work work[MOST];
    set_all(work, MOST, 6, 4);
    for (uint32_t slots = 1; slots <= 12; ++slots) {
        for (uint32_t room = 1; room <= 13; ++room) {
            const uint32_t at_once = room < slots ? room : slots, count = 60;
            qp_machine m = plain(1, slots, slots % 2 == 0);
            const qp_pipeline_result r = run(work, count, &m, 6 * room, NULL);
            const uint32_t rounds = (count + at_once - 1) / at_once;
            CHECK(r.cycles == 10.0 * rounds);
            CHECK(r.in_flight == at_once && r.peak_bytes == at_once * 6u * POINT);
            CHECK(r.wasted_bytes == 0);
            CHECK(r.wraps == (count - 1) / room);
            CHECK_NEAR(r.occupancy, (double)count / rounds / slots, 1e-12);
            CHECK((r.stall_cycles > 0) == (room < slots));
            if (room == 1) CHECK(r.stalls == (slots == 1 ? 0 : count - 1));
        }
    }
}

/* Without a ring's limits and out of order, it is list scheduling: whoever is next takes the slot that is free first. */
static void list_scheduling(void) {
    qp_random random = {5};
    for (int round = 0; round < 200; ++round) {
        qp_patch_work work[MOST];
        const uint32_t count = 1 + qp_random_below(&random, MOST), slots = 1 + qp_random_below(&random, 12);
        double free_at[12] = {0}, end = 0, most = 0, sum = 0;
        for (uint32_t i = 0; i < count; ++i) {
            work[i] =
                (qp_patch_work){i, 1 + qp_random_below(&random, 50), 1, 1 + qp_random_below(&random, 50)};
            const double d = work[i].points + work[i].samples;
            uint32_t first = 0;
            for (uint32_t s = 1; s < slots; ++s)
                if (free_at[s] < free_at[first]) first = s;
            free_at[first] += d;
            if (free_at[first] > end) end = free_at[first];
            if (d > most) most = d;
            sum += d;
        }
        const qp_machine m = plain(1, slots, true);
        const qp_pipeline_result r = run(work, count, &m, 0, NULL);
        CHECK(r.cycles == end);
        /* Graham's bound, and the two that nothing beats. */
        CHECK(r.cycles <= sum / slots + most * (1 - 1.0 / slots) + 1e-9);
        CHECK(r.cycles >= most && r.cycles >= sum / slots - 1e-9);
    }
}

static void order_of_retirement(void) {
    /* Alone for 10, 1, 1, 1 cycles; two slots. */
    qp_patch_work work[4];
    set_all(work, 4, 1, 0);
    work[0].points = 1;
    work[0].samples = 9;
    const qp_machine in_order = plain(1, 2, false), out_of_order = plain(1, 2, true);
    qp_patch_times times[4];
    qp_pipeline_result r = run(work, 4, &in_order, 0, times);
    CHECK(r.cycles == 11 && r.stalls == 0); /* 1 is done at 1 and keeps its slot until 10 */
    CHECK(times[1].done == 1 && times[1].retired == 10 && times[2].allocated == 10);
    CHECK_NEAR(r.occupancy, 13.0 / 22, 1e-15); /* who waits to retire is not at work */
    r = run(work, 4, &out_of_order, 0, times);
    CHECK(r.cycles == 10 && times[2].allocated == 1 && times[3].done == 3 && times[3].retired == 10);
    CHECK(r.peak_bytes == 4 * POINT); /* all places are kept for patch 0 */
    r = run(work, 4, &out_of_order, 2, times);
    CHECK(r.cycles == 11 && r.stalls == 1 && r.stall_cycles == 9); /* from 1 to 10 */
    r = run(work, 4, &out_of_order, 3, times);
    CHECK(r.cycles == 11 && r.stalls == 1 && r.stall_cycles == 8);
}

static void places_on_the_ring(void) {
    qp_patch_work work[3];
    set_all(work, 3, 4, 4);
    work[1].samples = 9;
    const qp_machine m = plain(1, 3, false);
    qp_pipeline_result r = run(work, 3, &m, 10, NULL);
    CHECK(r.wraps == 1 && r.wasted_bytes == 2 * POINT && r.stalls == 1);
    CHECK(r.cycles == 16 &&
          r.stall_cycles == 8); /* 4 + 4 of 10: the third one needs the 2 left and the first one's 4 */
    r = run(work, 3, &m, 12, NULL);
    CHECK(r.wraps == 0 && r.cycles == 13);
    /* An empty ring begins anew at no cost: 6 + 6 never fit 10, one after the other does. */
    set_all(work, 3, 6, 4);
    r = run(work, 3, &m, 10, NULL);
    CHECK(r.wraps == 2 && r.wasted_bytes == 0 && r.cycles == 30);
    /* Patches without points pass by, in order of issue. */
    work[1].points = 0;
    qp_patch_times times[3];
    r = run(work, 3, &m, 10, times);
    CHECK(times[1].allocated == 0 && times[1].done == 4 && times[1].retired == 10);
    CHECK(times[2].allocated == 10 && r.allocations == 2 && r.in_flight == 2);
}

static void sharing(void) {
    const qp_patch_work work[] = {{0, 0, 1, 1}, {1, 0, 1, 3}};
    qp_machine m = plain(1, 2, false);
    m.fill = 1;
    m.domain_rate = 1;
    qp_patch_times times[2];
    CHECK(run(work, 2, &m, 0, times).cycles == 4); /* the SM is never idle: 1 + 3 */
    CHECK(times[0].done == 2);                     /* half of it each */
    m.fill = 2;
    CHECK(run(work, 2, &m, 0, times).cycles == 6); /* each at half speed, alone or not */
    CHECK(times[0].done == 2);
    m.fill = 1;
    m.sms = 2;
    CHECK(run(work, 2, &m, 0, times).cycles == 3); /* an SM each */
    CHECK(times[0].done == 1 && times[0].sm == 0 && times[1].sm == 1);
    /* Tessellators: own ones work side by side, a shared one serves who comes first. */
    m.tessellator_rate = 0.5;
    CHECK(run(work, 2, &m, 0, times).cycles == 9);
    m.tessellator_shared = true;
    CHECK(run(work, 2, &m, 0, times).cycles == 11);
    CHECK(times[0].tessellated == 2 && times[1].tessellated == 8);
}

static void smallest_rings(void) {
    qp_patch_work work[MOST];
    const qp_machine m = plain(2, 6, false);
    qp_error err = {0};
    uint64_t bytes;
    set_all(work, 120, 8, 3);
    CHECK_OK(qp_pipeline_smallest_ring(work, 120, &m, 1.0, POINT, &bytes, &err), err);
    CHECK(bytes == 12 * 8 * POINT);
    CHECK_OK(qp_pipeline_smallest_ring(work, 120, &m, 0.5, POINT, &bytes, &err), err);
    CHECK(bytes == 6 * 8 * POINT);
    CHECK_OK(qp_pipeline_smallest_ring(work, 120, &m, 0.5, 1000, &bytes, &err), err);
    CHECK(bytes == 1000);
    CHECK_OK(qp_pipeline_smallest_ring(work, 120, &m, 0.0, POINT, &bytes, &err), err);
    CHECK(bytes == 8 * POINT);
    CHECK_OK(qp_pipeline_smallest_ring(work, 120, &m, 1.0, 1000, &bytes, &err), err);
    CHECK(bytes == 2000);
    CHECK_OK(qp_pipeline_smallest_ring(work, 5, &m, 1.0, 1000, &bytes, &err), err);
    CHECK(bytes == 5 * 8 * POINT); /* all of them */
    set_all(work, 120, 0, 3);
    CHECK_OK(qp_pipeline_smallest_ring(work, 120, &m, 1.0, POINT, &bytes, &err), err);
    CHECK(bytes == 0);
    CHECK_OK(qp_pipeline_smallest_ring(work, 0, &m, 1.0, POINT, &bytes, &err), err);
    CHECK(bytes == 0 && run(work, 0, &m, 0, NULL).cycles == 0);
}

static void refusals(void) {
    qp_patch_work work[2];
    set_all(work, 2, 8, 3);
    const qp_machine good = QP_MACHINE_PAPER;
    qp_pipeline_result r;
    qp_error err = {0};
    for (int i = 0; i < 8; ++i) {
        qp_machine m = good;
        const double bad[] = {0, -1, NAN, INFINITY};
        if (i == 0) m.sms = 0;
        if (i == 1) m.warps = 0;
        if (i == 2) m.point_bytes = 0;
        if (i == 3) m.latency = -1;
        if (i >= 4) m.hull_rate = bad[i - 4];
        CHECK(qp_pipeline_run(work, 2, &m, 0, &r, NULL, &err) == QP_BAD_INPUT);
        m = good;
        if (i >= 4) m.domain_rate = bad[i - 4];
        if (i >= 5) m.tessellator_rate = bad[i - 4];
        if (i >= 4) CHECK(qp_pipeline_run(work, 2, &m, 0, &r, NULL, &err) == QP_BAD_INPUT);
    }
    CHECK(qp_pipeline_run(work, 2, &good, 127, &r, NULL, &err) == QP_BAD_INPUT);
    CHECK(strstr(err.message, "127") != NULL && strstr(err.message, "128") != NULL);
    CHECK(qp_pipeline_run(work, 2, &good, 128, &r, NULL, &err) == QP_OK);
    CHECK(qp_pipeline_run(work, 2, &good, 143, &r, NULL, &err) == QP_OK && r.in_flight == 1);
}

/* ---- Tick by tick ---- */

typedef struct slow_patch {
    int stage; /* 0 not issued, 1 latency, 2 hull, 3 tessellator, 4 domain, 5 done, 6 retired */
    double left;
    uint32_t sm;
} slow_patch;

typedef struct slow {
    const qp_patch_work *work;
    uint32_t count;
    qp_machine machine;
    slow_patch patches[MOST];
    uint32_t next, oldest;
    uint32_t ring_points, head;     /* 0: unlimited */
    uint32_t owner[1 << 12];        /* of each point of the ring: 1 + patch; skipped points too */
    uint32_t queue[MOST_SMS][MOST]; /* of each tessellator */
    uint32_t first[MOST_SMS], last[MOST_SMS];
    uint64_t wraps, wasted;
    double now;
    qp_patch_times times[MOST];
} slow;

static uint32_t slow_held(const slow *s, uint32_t sm) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->next; ++i) {
        const int stage = s->patches[i].stage;
        if (s->patches[i].sm == sm && stage != 6 && !(stage == 5 && s->machine.out_of_order)) ++n;
    }
    return n;
}

static bool slow_all_free(const slow *s, uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i)
        if (s->owner[i] != 0) return false;
    return true;
}

static bool slow_take(slow *s, uint32_t patch) {
    const uint32_t n = s->work[patch].points;
    if (n == 0 || s->ring_points == 0) return true;
    uint32_t at = s->head;
    if (at + n > s->ring_points) {
        const bool empty = slow_all_free(s, 0, s->ring_points);
        if (!slow_all_free(s, at, s->ring_points) || !slow_all_free(s, 0, n)) return false;
        ++s->wraps;
        for (uint32_t i = at; i < s->ring_points && !empty; ++i) {
            s->owner[i] = 1 + patch;
            ++s->wasted;
        }
        at = 0;
    } else if (!slow_all_free(s, at, at + n)) {
        return false;
    }
    for (uint32_t i = at; i < at + n; ++i) s->owner[i] = 1 + patch;
    s->head = at + n;
    return true;
}

static void slow_enter(slow *s, uint32_t i, int stage) {
    const qp_machine *m = &s->machine;
    const double fill = m->fill == 0 ? m->warps : m->fill;
    slow_patch *p = &s->patches[i];
    if (stage == 3) s->times[i].hulled = s->now;
    if (stage == 3 && m->tessellator_rate == 0) stage = 4;
    p->stage = stage;
    if (stage == 1) p->left = m->latency;
    if (stage == 2) p->left = (double)s->work[i].points * s->work[i].ring / m->hull_rate * fill;
    if (stage == 3) {
        const uint32_t unit = m->tessellator_shared ? 0 : p->sm;
        s->queue[unit][s->last[unit]++] = i;
        p->left = s->work[i].samples / m->tessellator_rate;
    }
    if (stage == 4) {
        s->times[i].tessellated = s->now;
        p->left = s->work[i].samples / m->domain_rate * fill;
    }
    if (stage == 5) s->times[i].done = s->now;
}

static double slow_speed(const slow *s, uint32_t i) {
    const slow_patch *p = &s->patches[i];
    const double fill = s->machine.fill == 0 ? s->machine.warps : s->machine.fill;
    if (p->stage == 1) return 1;
    if (p->stage == 3) {
        const uint32_t unit = s->machine.tessellator_shared ? 0 : p->sm;
        return s->queue[unit][s->first[unit]] == i ? 1 : 0;
    }
    if (p->stage != 2 && p->stage != 4) return 0;
    double n = 0;
    for (uint32_t k = 0; k < s->next; ++k)
        n += s->patches[k].sm == p->sm && (s->patches[k].stage == 2 || s->patches[k].stage == 4);
    return n > fill ? fill / n : 1;
}

static void slow_settle(slow *s) {
    const double close = 1e-9;
    for (bool again = true; again;) {
        again = false;
        for (uint32_t i = 0; i < s->next; ++i) {
            slow_patch *p = &s->patches[i];
            if (p->stage == 0 || p->stage >= 5 || p->left > close) continue;
            if (p->stage == 3) {
                const uint32_t unit = s->machine.tessellator_shared ? 0 : p->sm;
                if (s->queue[unit][s->first[unit]] != i) continue;
                ++s->first[unit];
            }
            slow_enter(s, i, p->stage + 1);
            again = true;
        }
        while (s->oldest < s->next && s->patches[s->oldest].stage == 5) {
            s->patches[s->oldest].stage = 6;
            s->times[s->oldest].retired = s->now;
            for (uint32_t k = 0; k < s->ring_points; ++k)
                if (s->owner[k] == 1 + s->oldest) s->owner[k] = 0;
            ++s->oldest;
            again = true;
        }
        while (s->next < s->count) {
            uint32_t sm = 0;
            for (uint32_t k = 1; k < s->machine.sms; ++k)
                if (slow_held(s, k) < slow_held(s, sm)) sm = k;
            if (slow_held(s, sm) == s->machine.warps || !slow_take(s, s->next)) break;
            const uint32_t i = s->next++;
            s->patches[i].sm = sm;
            s->times[i] = (qp_patch_times){.sm = sm, .allocated = s->now};
            slow_enter(s, i, s->work[i].points == 0 ? 3 : 1);
            again = true;
        }
    }
}

/* tick 0: as long as nothing ends. */
static void slow_run(slow *s, double tick) {
    for (slow_settle(s); s->oldest < s->count; slow_settle(s)) {
        double step = tick;
        for (uint32_t i = 0; i < s->next && tick == 0; ++i) {
            const double v = slow_speed(s, i);
            if (v > 0 && (step == 0 || s->patches[i].left / v < step)) step = s->patches[i].left / v;
        }
        double speeds[MOST];
        for (uint32_t i = 0; i < s->next; ++i) speeds[i] = slow_speed(s, i);
        for (uint32_t i = 0; i < s->next; ++i) s->patches[i].left -= step * speeds[i];
        s->now += step;
    }
}

/* What must hold whatever the machine: places, order, and sums. */
static void check_times(const qp_patch_work *work, uint32_t count, const qp_machine *m, uint64_t ring_points,
                        const qp_pipeline_result *r, const qp_patch_times *t) {
    double busy = 0, sm_work = 0, fill = m->fill == 0 ? m->warps : m->fill, last = 0;
    uint64_t points = 0, most_live = 0, most_bin = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const double hull = (double)work[i].points * work[i].ring / m->hull_rate,
                     domain = work[i].samples / m->domain_rate;
        busy += t[i].done - t[i].allocated;
        sm_work += hull + domain;
        points += work[i].points;
        CHECK(t[i].hulled - t[i].allocated >= hull * fill - 1e-6);
        CHECK(t[i].done - t[i].tessellated >= domain * fill - 1e-6);
        CHECK(t[i].retired >= t[i].done);
        CHECK(i == 0 || (t[i].allocated >= t[i - 1].allocated && t[i].retired >= t[i - 1].retired));
        last = t[i].retired;
        uint64_t live = 0, held = 0;
        for (uint32_t k = 0; k <= i; ++k) {
            if (t[k].retired > t[i].allocated) live += work[k].points;
            if ((m->out_of_order ? t[k].done : t[k].retired) > t[i].allocated && t[k].sm == t[i].sm) ++held;
        }
        if (live > most_live) most_live = live;
        CHECK(held <= m->warps);
    }
    for (uint32_t i = 0; i < r->live_bins; ++i)
        if (r->live_bytes[i] > most_bin) most_bin = r->live_bytes[i];
    CHECK(r->cycles == last);
    CHECK_NEAR(r->occupancy * r->cycles * m->sms * m->warps, busy, 1e-6 * (1 + busy));
    CHECK(r->cycles >= sm_work / m->sms - 1e-6);
    CHECK(r->allocated_bytes == points * POINT);
    /* Patches that live for no time at all are in no interval. */
    CHECK(r->peak_bytes == most_live * POINT && most_bin == r->peak_bytes);
    CHECK(ring_points == 0 || r->peak_bytes <= ring_points * POINT);
    CHECK(r->in_flight <= m->sms * m->warps && r->stall_cycles <= r->cycles);
    CHECK(r->live_bins * r->live_cycles >= r->cycles && (r->live_bins - 1) * r->live_cycles < r->cycles);
    CHECK(r->live_bins <= QP_LIVE_BINS);
}

/* shared: patches share SMs at uneven rates, and times are equal but for rounding, which must not decide who comes first: works are so
 * various that no two end at one time. Else all times are whole numbers, and equal. */
static void random_case(qp_random *random, bool shared) {
    enum { fine = 1 << 20 };
    static slow s;
    qp_patch_work work[MOST];
    qp_patch_times times[MOST];
    memset(&s, 0, sizeof s);
    qp_machine m = plain(1 + qp_random_below(random, MOST_SMS), 1 + qp_random_below(random, 6),
                         qp_random_chance(random, 0.5));
    m.latency = qp_random_below(random, 6);
    m.tessellator_shared = qp_random_chance(random, 0.5);
    if (qp_random_chance(random, 0.6)) m.tessellator_rate = qp_random_chance(random, 0.5) ? 1 : 0.5;
    const uint32_t count = 1 + qp_random_below(random, shared ? 60 : 120);
    if (shared) {
        m.fill = 1 + qp_random_below(random, m.warps);
        m.hull_rate = 0.1 + 5 * qp_random_unit(random);
        m.domain_rate = 0.1 + 5 * qp_random_unit(random);
        m.latency += qp_random_unit(random);
        m.tessellator_rate *= 0.5 + qp_random_unit(random);
        m.hull_rate *= fine;
        m.domain_rate *= fine;
        m.tessellator_rate *= fine;
    }
    uint32_t largest = 0, sum = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t points = qp_random_chance(random, 0.2) ? 0 : 1 + qp_random_below(random, 20);
        work[i] = (qp_patch_work){i, points, 1 + qp_random_below(random, 3), 1 + qp_random_below(random, 30)};
        if (shared) {
            work[i].ring = 1 + qp_random_below(random, 3 * fine);
            work[i].samples = 1 + qp_random_below(random, 30 * fine);
        }
        if (points > largest) largest = points;
        sum += points;
    }
    if (qp_random_chance(random, 0.8)) {
        const uint32_t most = largest * m.sms * m.warps + 1;
        s.ring_points = largest + qp_random_below(random, most < sum + 1 ? most : sum + 1);
        if (s.ring_points == 0) s.ring_points = 1;
    }
    s.work = work;
    s.count = count;
    s.machine = m;
    slow_run(&s, shared ? 0 : 1);
    const qp_pipeline_result r = run(work, count, &m, s.ring_points, times);
    check_times(work, count, &m, s.ring_points, &r, times);
    const double tolerance = shared ? 1e-6 : 0;
    for (uint32_t i = 0; i < count; ++i) {
        CHECK_NEAR(times[i].allocated, s.times[i].allocated, tolerance);
        CHECK_NEAR(times[i].hulled, s.times[i].hulled, tolerance);
        CHECK_NEAR(times[i].tessellated, s.times[i].tessellated, tolerance);
        CHECK_NEAR(times[i].done, s.times[i].done, tolerance);
        CHECK_NEAR(times[i].retired, s.times[i].retired, tolerance);
        CHECK(times[i].sm == s.times[i].sm);
    }
    CHECK(r.wraps == s.wraps && r.wasted_bytes == s.wasted * POINT);
}

/* With fixed times of patches and slots that free themselves, a patch begins when the one before has begun, a slot is free and there is room:
 * by induction no later where there is always room. In order, the same. */
static void no_ring_is_never_slower(void) {
    qp_random random = {77};
    for (int round = 0; round < 300; ++round) {
        qp_patch_work work[MOST];
        const uint32_t count = 1 + qp_random_below(&random, MOST);
        const qp_machine m = plain(1 + qp_random_below(&random, 3), 1 + qp_random_below(&random, 4),
                                   qp_random_chance(&random, 0.5));
        for (uint32_t i = 0; i < count; ++i)
            work[i] = (qp_patch_work){i, 1 + qp_random_below(&random, 30), 1, qp_random_below(&random, 60)};
        const qp_pipeline_result scratch = run(work, count, &m, 0, NULL);
        CHECK(scratch.stall_cycles == 0 && scratch.stalls == 0);
        for (uint32_t ring = 30; ring < 300; ring += 1 + qp_random_below(&random, 60)) {
            const qp_pipeline_result r = run(work, count, &m, ring, NULL);
            CHECK(r.cycles >= scratch.cycles && r.in_flight <= scratch.in_flight);
            CHECK(r.cycles <= scratch.cycles + r.stall_cycles * (1 + 1e-12));
        }
    }
}

/* ---- The work of a mesh ---- */

static void work_of_meshes(void) {
    qp_error err = {0};
    const char *const kinds[] = {"torus", "cube", "prism", "creased-torus"};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; ++k) {
        qp_mesh *mesh = NULL;
        qp_surface *surface = NULL;
        qp_patch_work *work = NULL;
        size_t count = 0;
        const qp_generate_options options = {.n = {k == 2 ? 5 : 0}, .sharpness = -1};
        CHECK_OK(qp_mesh_generate(kinds[k], &options, &mesh, &err), err);
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err);
        for (uint32_t factor = 1; factor <= 64; factor *= 4) {
            const qp_tessellation tess = {.factor = (float)factor};
            for (int by_plan = 0; by_plan < 2; ++by_plan) {
                qp_frame_layout layout;
                uint64_t samples = 0;
                CHECK_OK(
                    qp_patch_work_list(surface, &tess, k == 0 ? 16 : 0, by_plan == 1, &work, &count, &err),
                    err);
                CHECK_OK(qp_layout_tessellate(surface, &tess, NULL, false, &layout, &err), err);
                CHECK(count == layout.n_items && count == mesh->n_patches);
                for (size_t i = 0; i < count; ++i) {
                    const uint32_t plan = surface->patch_plan[work[i].patch];
                    samples += work[i].samples;
                    CHECK(by_plan == 1 || work[i].patch == i);
                    if (i > 0 && by_plan == 1) {
                        const uint32_t before = surface->patch_plan[work[i - 1].patch];
                        CHECK(before == plan ? work[i - 1].patch < work[i].patch
                                             : before < plan || plan == surface->regular_plan);
                    }
                    if (plan == surface->regular_plan)
                        CHECK(work[i].points == (k == 0 ? 16u : 0u) && work[i].ring == 1);
                    else
                        CHECK(work[i].ring == surface->plans[plan]->ring_size && work[i].points > 0 &&
                              work[i].points <= surface->plans[plan]->point_count);
                    if (factor == 64 && plan != surface->regular_plan && k != 2)
                        CHECK(work[i].points == surface->plans[plan]->rows[6]);
                }
                CHECK(samples == layout.n_samples);
                qp_layout_free(&layout);
                free(work);
            }
        }
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
}

int main(void) {
    one_slot_adds_up();
    equal_patches();
    list_scheduling();
    order_of_retirement();
    places_on_the_ring();
    sharing();
    smallest_rings();
    refusals();
    no_ring_is_never_slower();
    work_of_meshes();
    qp_random random = {1};
    const int rounds = CHECK_SANITIZED ? 100 : 600;
    for (int i = 0; i < rounds; ++i) random_case(&random, i % 2 == 1);
    return check_report();
}
