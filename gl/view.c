#include "gl/view.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static void cross(const double a[3], const double b[3], double out[3]) {
    double c[3];
    for (int k = 0; k < 3; k++) c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    memcpy(out, c, sizeof c);
}
static void normalise(double a[3]) {
    double length = sqrt(dot(a, a));
    for (int k = 0; k < 3; k++) a[k] /= length;
}

/* Axes across `axis`: front is z, or -y for an upright z. */
static void axes_of_up(const double axis[3], double right[3], double front[3]) {
    double reference[3] = {0, 0, 1};
    if (fabs(axis[2]) > 0.9 * sqrt(dot(axis, axis))) reference[1] = -1, reference[2] = 0;
    double along = dot(reference, axis);
    for (int k = 0; k < 3; k++) front[k] = reference[k] - along * axis[k];
    normalise(front);
    cross(axis, front, right);
}

static void direction(const qp_view *view, double azimuth, double elevation, double out[3]) {
    double right[3], front[3], a = azimuth * pi / 180, e = elevation * pi / 180;
    axes_of_up(view->world_up, right, front);
    for (int k = 0; k < 3; k++)
        out[k] = cos(e) * (sin(a) * right[k] + cos(a) * front[k]) + sin(e) * view->world_up[k];
}

static void bound(const float *points, size_t count, qp_view *view) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, most = 0;
    view->floor = INFINITY;
    for (size_t i = 0; i < count; i++) {
        double p[3] = {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
        for (int k = 0; k < 3; k++) low[k] = fmin(low[k], p[k]), high[k] = fmax(high[k], p[k]);
        view->floor = fmin(view->floor, dot(p, view->world_up));
    }
    for (int k = 0; k < 3; k++) view->centre[k] = 0.5 * (low[k] + high[k]);
    for (size_t i = 0; i < count; i++) {
        double d[3];
        for (int k = 0; k < 3; k++) d[k] = points[3 * i + (size_t)k] - view->centre[k];
        most = fmax(most, dot(d, d));
    }
    view->radius = most > 0 ? sqrt(most) : 1;
}

/* The eye from which all points just fill the picture. In camera axes about the centre a point (x, y, z) is
 * seen within half-width t = tan(angle) iff |x - ex| <= (d - z) t: with A = max(x + z t), B = max(-x + z t)
 * that is d >= (A + B) / (2 t), ex = (A - B) / 2; y likewise. */
static void fit(const qp_scene *scene, const float *points, size_t count, qp_view *view) {
    double ty = tan(scene->fov * pi / 360), tx = ty * scene->width / scene->height;
    double a = -INFINITY, b = -INFINITY, c = -INFINITY, d = -INFINITY;
    for (size_t i = 0; i < count; i++) {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = points[3 * i + (size_t)k] - view->centre[k];
        double x = dot(p, view->right), y = dot(p, view->up), z = dot(p, view->back);
        a = fmax(a, x + z * tx), b = fmax(b, -x + z * tx);
        c = fmax(c, y + z * ty), d = fmax(d, -y + z * ty);
    }
    double away = 1.08 * fmax((a + b) / (2 * tx), (c + d) / (2 * ty)) / scene->zoom;
    if (!(away > 1e-3 * view->radius)) away = 1e-3 * view->radius;
    for (int k = 0; k < 3; k++)
        view->eye[k] = view->centre[k] + 0.5 * (a - b) * view->right[k] + 0.5 * (c - d) * view->up[k] +
                       away * view->back[k];
}

static void project(const qp_scene *scene, qp_view *view) {
    double to[3];
    for (int k = 0; k < 3; k++) to[k] = view->centre[k] - view->eye[k];
    double depth = -dot(to, view->back);
    double near = fmax(depth - 1.5 * view->radius, 1e-3 * view->radius);
    double far = fmax(depth + 30 * view->radius, 2 * near);
    double ty = tan(scene->fov * pi / 360), tx = ty * scene->width / scene->height;
    double za = -(far + near) / (far - near), zb = -2 * far * near / (far - near);
    double x = -dot(view->right, view->eye), y = -dot(view->up, view->eye), z = -dot(view->back, view->eye);
    float *m = view->view_projection;
    for (int k = 0; k < 3; k++) {
        m[4 * k] = (float)(view->right[k] / tx);
        m[4 * k + 1] = (float)(view->up[k] / ty);
        m[4 * k + 2] = (float)(view->back[k] * za);
        m[4 * k + 3] = (float)-view->back[k];
    }
    m[12] = (float)(x / tx), m[13] = (float)(y / ty), m[14] = (float)(z * za + zb), m[15] = (float)-z;
}

void qp_view_make(const qp_scene *scene, const float *points, size_t count, qp_view *view) {
    memcpy(view->world_up, scene->up, sizeof view->world_up);
    normalise(view->world_up);
    bound(points, count, view);
    if (scene->fit)
        direction(view, scene->azimuth, scene->elevation, view->back);
    else
        for (int k = 0; k < 3; k++) view->back[k] = scene->eye[k] - scene->target[k];
    normalise(view->back);
    cross(view->world_up, view->back, view->right);
    normalise(view->right);
    cross(view->back, view->right, view->up);
    memcpy(view->eye, scene->eye, sizeof view->eye);
    if (scene->fit) fit(scene, points, count, view);
    project(scene, view);
}

/* ---- Lamps ---- */

static double fraction(double x) {
    return x - floor(x);
}
/* Point k of the plane's golden-ratio sequence, evenly spread over the unit square whatever the count. */
static void spread(uint32_t k, double out[2]) {
    out[0] = fraction(0.5 + 0.7548776662466927 * k);
    out[1] = fraction(0.5 + 0.5698402909980532 * k);
}

static void set_lamp(const qp_view *view, const double l[3], const double radiance[3], double scale,
                     qp_lamp *lamp) {
    double right[3], front[3];
    axes_of_up(l, right, front);
    const double *axes[3] = {right, front, l};
    for (int r = 0; r < 3; r++) {
        lamp->direction[r] = (float)l[r];
        lamp->radiance[r] = (float)(radiance[r] * scale);
        double sign = r == 2 ? -1 : 1, inverse = sign / (1.01 * view->radius); /* depth grows away from it */
        for (int k = 0; k < 3; k++) lamp->rows[4 * r + k] = (float)(axes[r][k] * inverse);
        lamp->rows[4 * r + 3] = (float)(-dot(axes[r], view->centre) * inverse);
    }
}

/* count samples of the disc of one light, equal in weight. */
static void disc(const qp_view *view, const qp_light *light, double azimuth, uint32_t count, qp_lamp *lamps) {
    double l[3], right[3], front[3];
    direction(view, azimuth + light->azimuth, light->elevation, l);
    axes_of_up(l, right, front);
    for (uint32_t k = 0; k < count; k++) {
        double s[2], sample[3];
        spread(k, s);
        double r = tan(light->size * pi / 180) * sqrt(s[0]), angle = 2 * pi * s[1];
        for (int j = 0; j < 3; j++) sample[j] = l[j] + r * (cos(angle) * right[j] + sin(angle) * front[j]);
        normalise(sample);
        set_lamp(view, sample, light->colour, light->intensity / count, lamps + k);
    }
}

/* The upper half of the sky, evenly: each sample stands for 2 pi / count of solid angle. */
static void sky(const qp_scene *scene, const qp_view *view, uint32_t count, qp_lamp *lamps) {
    double right[3], front[3];
    axes_of_up(view->world_up, right, front);
    for (uint32_t k = 0; k < count; k++) {
        double s[2], l[3], colour[3];
        spread(k, s);
        double z = (k + 0.5) / count, r = sqrt(1 - z * z), angle = 2 * pi * s[1], t = sqrt(z);
        for (int j = 0; j < 3; j++) {
            l[j] = r * (cos(angle) * right[j] + sin(angle) * front[j]) + z * view->world_up[j];
            colour[j] = (1 - t) * scene->sky_horizon[j] + t * scene->sky_zenith[j];
        }
        set_lamp(view, l, colour, 2 * scene->sky_intensity / count, lamps + k);
    }
}

void qp_view_lamps(const qp_scene *scene, const qp_view *view, uint32_t count, qp_lamp *lamps,
                   uint32_t *lamp_count) {
    double right[3], front[3];
    axes_of_up(view->world_up, right, front);
    double azimuth = atan2(dot(view->back, right), dot(view->back, front)) * 180 / pi;
    uint32_t key = count / 4, fill = count / 8, rim = count / 8;
    disc(view, &scene->key, azimuth, key, lamps);
    disc(view, &scene->fill, azimuth, fill, lamps + key);
    disc(view, &scene->rim, azimuth, rim, lamps + key + fill);
    *lamp_count = key + fill + rim;
    sky(scene, view, count - *lamp_count, lamps + *lamp_count);
}
