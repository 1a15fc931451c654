#include "host/frame/classify.h"

void qp_rotate_uv(uint32_t rotation, float *u, float *v) {
    float a = *u, b = *v;
    switch (rotation & 3u) {
    case 1:
        *u = b, *v = 1 - a;
        break;
    case 2:
        *u = 1 - a, *v = 1 - b;
        break;
    case 3:
        *u = 1 - b, *v = a;
        break;
    default:
        break;
    }
}

/* The half in which x of a node lies; at the middle the upper one, or the lower one on a tie. x becomes its
 * place there. */
static uint32_t enter_half(float *x, uint32_t tie) {
    uint32_t upper = *x > 0.5f || (*x == 0.5f && !tie);
    *x = 2 * *x - (float)upper;
    return upper;
}

qp_leaf qp_classify(const qp_plan *plan, float u, float v) {
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
                if (u >= 0.5f || v >= 0.5f) return (qp_leaf){QP_NODE_TERMINAL, level};
                u *= 2, v *= 2;
            }
            qp_rotate_uv(4 - QP_NODE_ROTATION(words[0]), &u, &v); /* back into the frame it was entered in */
            node = words[2];
        } else {
            return (qp_leaf){kind, level};
        }
    }
}
