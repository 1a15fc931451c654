/* Where the camera stands and where light comes from. */
#ifndef QP_GL_VIEW_H
#define QP_GL_VIEW_H

#include "host/scene/scene.h"

typedef struct qp_view {
    double eye[3];
    double right[3], up[3], back[3]; /* camera axes; it looks along -back */
    double world_up[3];
    float view_projection[16]; /* column-major */
    double centre[3], radius;  /* a sphere around all points */
    double floor;              /* least height of a point: its product with world_up */
} qp_view;

/* count points of 3 floats, finite, at least one. */
void qp_view_make(const qp_scene *scene, const float *points, size_t count, qp_view *view);

/* A light from one direction. */
typedef struct qp_lamp {
    float direction[3]; /* towards the light */
    float radiance[3];  /* what a surface facing it gets from this sample, divided by pi */
    float rows[12];     /* affine map of the sphere of the view into [-1,1]^3, for its shadow map */
} qp_lamp;

/* Fills count (at least 8) lamps: key, fill and rim first, *lamp_count of them, then the sky. */
void qp_view_lamps(const qp_scene *scene, const qp_view *view, uint32_t count, qp_lamp *lamps,
                   uint32_t *lamp_count);

#endif
