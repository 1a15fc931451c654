// What the tessellation path knows of a frame: the plans' own bytes (kernels/plan_layout.h says what the words mean), the base vertices,
// and a record for every patch and every tessellated part. Buffers are bound by gl/tessellation.c.
layout(std430, binding = 0) readonly buffer Heads { uint heads[]; };
layout(std430, binding = 1) readonly buffer Trees { uint trees[]; };
layout(std430, binding = 2) readonly buffer Reals { float reals[]; };
layout(std430, binding = 3) readonly buffer Rings { uint rings[]; };
layout(std430, binding = 4) readonly buffer Vertices { float vertices[]; };  // 3 a base vertex, in the local frame

struct Patch {
    uint head;      // first word of the plan's head
    uint ring;      // first of its base vertices in rings
    uint support;   // first of its control points
    uint rows;      // how many of them are needed
    uint rotation;  // of the plan against the patch
    uint unused0, unused1, unused2;
};
layout(std430, binding = 5) readonly buffer Patches { Patch patches[]; };

struct Part {
    vec4 outer;
    vec2 inner;
    vec2 corner;  // of the part in its patch
    vec3 colour;  // square root of linear light
    float side;   // 1: the whole patch, 1/2: a quarter
    uint patch_index;
    uint number;  // among all parts of the frame
    uint unused0, unused1;
};
layout(std430, binding = 6) readonly buffer Parts { Part parts[]; };

const uint HEAD_RING = 0u, HEAD_POINTS = 1u, HEAD_TREE = 2u, HEAD_REALS = 3u, HEAD_FLAGS = 4u;
const uint PLAN_MODES = 64u, NO_POINT = 0xffffu;
const uint NODE_INTERNAL = 0u, NODE_REGULAR = 1u, NODE_CREASE = 2u, NODE_TERMINAL = 3u, NODE_EXTRAORDINARY = 4u;
const uint NODE_HAS_MODE = 1u << 24;

vec3 vertex_at(uint v) {
    return vec3(vertices[3u * v], vertices[3u * v + 1u], vertices[3u * v + 2u]);
}
