/* Scene files: what to draw and how (docs/scene-format.md). */
#ifndef QP_SCENE_SCENE_H
#define QP_SCENE_SCENE_H

#include "host/mesh/mesh.h"

/* What a surface is coloured by. */
typedef enum qp_colour {
    QP_COLOUR_MATERIAL,
    QP_COLOUR_KIND,      /* quadtree node that evaluates a sample: the paper's figures 2 and 5 */
    QP_COLOUR_LEVEL,     /* subdivision level of that node */
    QP_COLOUR_PLAN,      /* one hue a plan: patches that share one look alike */
    QP_COLOUR_PATCH,     /* one hue a patch */
    QP_COLOUR_NORMAL,    /* the unit normal as a colour */
    QP_COLOUR_COMPONENT, /* the palette's colours, by connected piece of the mesh */
} qp_colour;
/* Name in scene files and on the command line; NULL past the last value. */
const char *qp_colour_name(qp_colour colour);
/* QP_BAD_INPUT, listing the names, when there is no such colour. */
qp_status qp_colour_from_name(const char *name, qp_colour *colour, qp_error *err);

/* A light from a direction. Angles in degrees: azimuth is counted from the camera to its right, elevation up from
 * the horizon. size: half-angle of the disc it comes
 * from, which softens its shadow. */
typedef struct qp_light {
    double azimuth, elevation, size, intensity, colour[3];
} qp_light;

enum { QP_PALETTE_MAX = 16 };

typedef struct qp_scene {
    char *path; /* of the file, for messages */
    char *why;  /* why the scene exists */

    char *mesh_path;     /* OBJ file, or NULL: generate_kind */
    char *generate_kind; /* kind for qp_mesh_generate, or NULL */
    qp_generate_options generate;

    qp_mesh_options mesh_options; /* overrides that the scene asks for; no warn callback */
    qp_surface_options surface_options;

    qp_spacing spacing;
    double factor;
    double tolerance;    /* 0: none; else factors are chosen, up to .factor */
    bool halve_ngons;    /* children of n-gons get half the factor, so that edges shared with quads match */
    bool random_factors; /* every edge and inside draws its own integer factor from [min, max] */
    uint64_t factor_seed;
    uint32_t factor_min, factor_max;

    bool fit; /* look at the whole mesh from azimuth, elevation; else eye, target, up */
    double azimuth, elevation, zoom;
    double eye[3], target[3], up[3];
    double fov; /* vertical, degrees */

    qp_light key, fill, rim;
    double sky_zenith[3], sky_horizon[3], sky_ground[3], sky_intensity;
    uint32_t shadow_samples; /* directions from which shadows are cast; 0: none */

    double colour[3], back_colour[3];  /* linear, of front and back */
    double palette[QP_PALETTE_MAX][3]; /* for QP_COLOUR_COMPONENT, in turn */
    uint32_t palette_count;
    double gloss, specular; /* 0..1 */
    bool ground;            /* a plane under the mesh that catches the shadow */
    double ground_colour[3];
    double background_top[3], background_bottom[3], background_alpha;

    uint32_t width, height;
    double exposure;
    qp_colour colour_by;
    double wire_width; /* pixels; 0: no tessellation wireframe */
    double wire_colour[3];

    /* Further views of the same geometry: each is this scene with a tessellation, a camera and a picture of its own, and a name. Its
     * other texts are this scene's, and it has no passes itself. */
    uint32_t n_passes;
    struct qp_scene *passes; /* [n_passes] */
    char *name;              /* of a pass; NULL: of the scene itself */
} qp_scene;

enum { QP_PASSES_MAX = 64 };

/* Reads and checks a scene file. QP_BAD_INPUT with "FILE: reason" or "FILE:LINE: reason"; unknown keys are
 * refused by name. The mesh is not read yet. */
qp_status qp_scene_read(const char *path, qp_scene **scene, qp_error *err);
/* The same from memory; name is what messages call it, and mesh files are relative to its folder. */
qp_status qp_scene_parse(const char *name, const char *text, size_t length, qp_scene **scene, qp_error *err);
void qp_scene_free(qp_scene *scene);

/* Reads or generates the scene's mesh with its subdivision options. warn may be NULL. */
qp_status qp_scene_mesh(const qp_scene *scene, void (*warn)(void *context, const char *line),
                        void *warn_context, qp_mesh **mesh, qp_error *err);

/* The scene's tessellation of a mesh. *factors, which tessellation may point to, is the caller's to free()
 * (NULL when all factors are the same). Factors of an edge are the same from both sides; where a quad meets
 * an n-gon, the quad's is twice its two neighbours', so that no cracks open under equal spacing. */
qp_status qp_scene_tessellation(const qp_scene *scene, const qp_mesh *mesh, qp_tessellation *tessellation,
                                float **factors, qp_error *err);

#endif
