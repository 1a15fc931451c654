/* Which node of a hand-made plan evaluates a point. */
#include "host/frame/classify.h"
#include "host/frame/frame.h"
#include "tests/check.h"

enum {
    ROOT = 0,
    REGULAR = 5,
    CREASE = 15,
    TERMINAL = 26,
    INNER = 26 + 3 + 24,
    END = INNER + 5,
    IRREGULAR = END + 4
};

/* Root: regular, crease / terminal, internal. The terminal's corner is (1,1) (rotation 2); it has two rings and ends
 * in an internal node whose own frame is not turned: its four children are extraordinary, but for the one at (0,0),
 * which is irregular. */
static uint32_t tree[80] = {
    [ROOT] = QP_NODE_INTERNAL | 1u << 5, /* ties go to the lower u and the upper v */
    [ROOT + 1] = REGULAR,
    [ROOT + 2] = CREASE,
    [ROOT + 3] = TERMINAL,
    [ROOT + 4] = INNER,
    [REGULAR] = QP_NODE_REGULAR,
    [CREASE] = QP_NODE_CREASE,
    [TERMINAL] = QP_NODE_TERMINAL | 2u << 3 | 2u << 8,
    [TERMINAL + 2] = INNER,
    [INNER] = QP_NODE_INTERNAL,
    [INNER + 1] = IRREGULAR,
    [INNER + 2] = END,
    [INNER + 3] = END,
    [INNER + 4] = END,
    [END] = QP_NODE_EXTRAORDINARY,
    [IRREGULAR] = QP_NODE_IRREGULAR,
};

static void expect(float u, float v, uint32_t kind, uint32_t level) {
    qp_plan plan = {.tree = tree, .tree_words = 80};
    qp_leaf leaf = qp_classify(&plan, qp_signed_coordinate((double)u, QP_DOUBLE),
                               qp_signed_coordinate((double)v, QP_DOUBLE));
    if (!CHECK(leaf.kind == kind && leaf.level == level))
        fprintf(stderr, "    (%g, %g): kind %u, level %u\n", (double)u, (double)v, leaf.kind, leaf.level);
}

int main(void) {
    expect(0.0f, 0.0f, QP_NODE_REGULAR, 1);
    expect(0.5f, 0.25f, QP_NODE_REGULAR, 1); /* the tie */
    expect(0.75f, 0.25f, QP_NODE_CREASE, 1);
    expect(0.60f, 0.60f, QP_NODE_IRREGULAR, 2);
    expect(0.75f, 0.5f, QP_NODE_EXTRAORDINARY, 2);
    /* The terminal covers u <= .5, v >= .5 and shrinks towards (.5, 1). */
    expect(0.1f, 0.6f, QP_NODE_TERMINAL, 2);
    expect(0.25f, 0.99f, QP_NODE_TERMINAL, 2);
    expect(0.3f, 0.8f, QP_NODE_TERMINAL, 3);
    expect(0.45f, 0.85f, QP_NODE_TERMINAL, 3);
    /* What remains is [.375, .5] x [.875, 1], entered unturned. */
    expect(0.40f, 0.90f, QP_NODE_IRREGULAR, 4);
    expect(0.49f, 0.99f, QP_NODE_EXTRAORDINARY, 4);
    expect(0.49f, 0.90f, QP_NODE_EXTRAORDINARY, 4);

    for (uint32_t r = 0; r < 4; r++) {
        double u = 0.25, v = -0.375; /* 5/8 */
        qp_rotate_uv(r, &u, &v);
        qp_rotate_uv(4 - r, &u, &v);
        CHECK(u == 0.25 && v == -0.375);
    }
    double u = 0.25, v = 0.0; /* one turn puts corner (0,0) of the plan at corner (1,0) of the patch */
    qp_rotate_uv(1, &u, &v);
    CHECK(u == 0.0 && v == -0.25);
    return check_report();
}
