#include "host/frame/classify.h"
#include "host/frame/coordinate.h"

void qp_rotate_uv(uint32_t rotation, double *u, double *v) {
    double a = *u, b = *v;
    switch (rotation & 3u) {
    case 1:
        *u = b, *v = qp_coordinate_mirrored(a);
        break;
    case 2:
        *u = qp_coordinate_mirrored(a), *v = qp_coordinate_mirrored(b);
        break;
    case 3:
        *u = qp_coordinate_mirrored(b), *v = a;
        break;
    default:
        break;
    }
}

/* The half in which x of a node lies; at the middle the upper one, or the lower one on a tie. x becomes its
 * place there. */
static uint32_t enter_half(double *x, uint32_t tie) {
    uint32_t upper = signbit(*x) || (*x == 0.5 && !tie);
    *x = qp_coordinate_in_half(*x, upper != 0);
    return upper;
}

static bool is_upper(double x) {
    return signbit(x) || x == 0.5;
}

qp_leaf qp_classify(const qp_plan *plan, double u, double v) {
    uint32_t node = 0, level = 0;
    for (;;) {
        const uint32_t *words = plan->tree + node;
        uint32_t kind = QP_NODE_KIND(words[0]);
        if (kind == QP_NODE_INTERNAL) {
            uint32_t right = enter_half(&u, QP_NODE_TIE_U(words[0]));
            uint32_t upper = enter_half(&v, QP_NODE_TIE_V(words[0]));
            node = words[1 + right + 2 * upper];
            level++;
        } else if (kind == QP_NODE_TERMINAL) {
            qp_rotate_uv(QP_NODE_ROTATION(words[0]), &u, &v);
            for (uint32_t ring = 0; ring < QP_NODE_RINGS(words[0]); ring++) {
                level++;
                if (is_upper(u) || is_upper(v))
                    return (qp_leaf){.kind = QP_NODE_TERMINAL, .level = level, .corner = u == 0 && v == 0};
                enter_half(&u, 0);
                enter_half(&v, 0);
            }
            qp_rotate_uv(4 - QP_NODE_ROTATION(words[0]), &u, &v); /* back into the frame it was entered in */
            node = words[2];
        } else {
            return (qp_leaf){.kind = kind, .level = level, .corner = u == 0 && v == 0};
        }
    }
}
