// All other patches: down the plan's quadtree to the leaf that holds (u,v), and the spline there (section 6 of the paper).
layout(std430, binding = 7) readonly buffer Support { vec4 support[]; };

// Relative to the patch's first ring vertex; derivatives in the leaf's frame, which has the patch's orientation.
struct Local {
    vec3 at, along_u, along_v;
};

uint tree, constants, points;

uint point_number(uint words, uint k) {
    return (trees[words + (k >> 1)] >> ((k & 1u) * 16u)) & 0xffffu;
}
vec4 point_at(uint words, uint k) {
    return support[points + point_number(words, k)];
}

// (u,v) as seen from a corner.
vec2 turned(uint rotation, vec2 uv) {
    if (rotation == 1u) return vec2(uv.y, 1.0 - uv.x);
    if (rotation == 2u) return vec2(1.0 - uv.x, 1.0 - uv.y);
    if (rotation == 3u) return vec2(1.0 - uv.y, uv.x);
    return uv;
}

// Sixteen points, `pitch` apart from row to row: their sums with the weights of rows and columns, fourth numbers included.
void net(uint words, uint first, uint pitch, vec4 bu, vec4 du, vec4 bv, vec4 dv, out vec4 at, out vec4 along_u,
         out vec4 along_v) {
    at = along_u = along_v = vec4(0.0);
    for (uint row = 0u; row < 4u; ++row) {
        vec4 sum = vec4(0.0), slope = vec4(0.0);
        for (uint i = 0u; i < 4u; ++i) {
            vec4 q = point_at(words, first + pitch * row + i);
            sum += bu[i] * q;
            slope += du[i] * q;
        }
        at += bv[row] * sum;
        along_u += bv[row] * slope;
        along_v += dv[row] * sum;
    }
}

Local of_spline(uint node, vec2 uv) {
    vec4 bu, du, bv, dv, at, along_u, along_v;
    spline(uv.x, bu, du);
    spline(uv.y, bv, dv);
    net(node + 2u, 0u, 4u, bu, du, bv, dv, at, along_u, along_v);
    if (trees[node + 1u] != NO_POINT) at += support[points + trees[node + 1u]];
    return Local(at.xyz, along_u.xyz, along_v.xyz);
}

// One semi-sharp crease along v = 0: three zones of v, each with a matrix between the spline and the points (Niessner and others 2012).
Local of_crease(uint node, vec2 uv) {
    uint c = constants + trees[node + 10u];
    uint zone = uv.y >= reals[c] ? 0u : uv.y >= reals[c + 1u] ? 1u : 2u;
    float scale = reals[c + 2u + zone];
    uint m = c + 5u + 16u * zone;
    vec4 bu, du, b, d, bv = vec4(0.0), dv = vec4(0.0), at, along_u, along_v;
    spline(uv.x, bu, du);
    spline(uv.y * scale, b, d);
    for (uint i = 0u; i < 4u; ++i) {
        vec4 row = vec4(reals[m + 4u * i], reals[m + 4u * i + 1u], reals[m + 4u * i + 2u], reals[m + 4u * i + 3u]);
        bv += b[i] * row;
        dv += scale * d[i] * row;
    }
    net(node + 2u, 0u, 4u, bu, du, bv, dv, at, along_u, along_v);
    if (trees[node + 1u] != NO_POINT) at += support[points + trees[node + 1u]];
    return Local(at.xyz, along_u.xyz, along_v.xyz);
}

// One of the three cells of a ring. mode: a point whose multiples, by the fourth numbers, are to be added. With a tangent t both
// products du x dv = du x (dv - t du), so what the two have in common along the mode is taken out before they are rounded.
Local of_ring(uint words, vec2 uv, uint mode) {
    uvec2 upper = uvec2(uv.x >= 0.5, uv.y >= 0.5);
    vec4 bu, du, bv, dv, at, along_u, along_v;
    spline(2.0 * uv.x - float(upper.x), bu, du);
    spline(2.0 * uv.y - float(upper.y), bv, dv);
    uint first = 5u * upper.y + upper.x;
    // Slot of (i, j) is 5 j + i - 1: the corner itself, (0, 0), is not among the cells.
    net(words, first - 1u, 5u, bu, du, bv, dv, at, along_u, along_v);
    if (mode == NO_POINT) return Local(at.xyz, along_u.xyz, along_v.xyz);
    vec3 axis = support[points + mode].xyz;
    vec3 place = at.xyz + at.w * axis;
    if (along_u.w == 0.0 && along_v.w == 0.0) return Local(place, along_u.xyz, along_v.xyz);
    if (abs(along_u.w) >= abs(along_v.w))
        return Local(place, along_u.xyz + along_u.w * axis, along_v.xyz - along_v.w / along_u.w * along_u.xyz);
    return Local(place, along_u.xyz - along_u.w / along_v.w * along_v.xyz, along_v.xyz + along_v.w * axis);
}

Local of_limit(uint first) {
    uvec3 words = uvec3(trees[first], trees[first + 1u], trees[first + 2u]);
    Local l = Local(support[points + words.x].xyz, vec3(0.0), vec3(0.0));
    if (words.y != NO_POINT && words.z != NO_POINT) {
        l.along_u = support[points + words.y].xyz;
        l.along_v = support[points + words.z].xyz;
    }
    return l;
}

// Four corners known, nothing between them.
Local of_corners(uint node, vec2 uv) {
    vec3 p[4], t;
    for (uint c = 0u; c < 4u; ++c) {
        uint k = 3u * c;
        p[c] = support[points + point_number(node + 1u, k)].xyz;
        vec2 corner = vec2(c == 1u || c == 2u, c >= 2u);
        if (uv == corner) {
            Local l = Local(p[c], vec3(0.0), vec3(0.0));
            uint t1 = point_number(node + 1u, k + 1u), t2 = point_number(node + 1u, k + 2u);
            if (t1 != NO_POINT && t2 != NO_POINT) {
                l.along_u = support[points + t1].xyz;
                l.along_v = support[points + t2].xyz;
            }
            return l;
        }
    }
    vec3 low = mix(p[0], p[1], uv.x), high = mix(p[3], p[2], uv.x);
    return Local(mix(low, high, uv.y), mix(p[1] - p[0], p[2] - p[3], uv.y), high - low);
}

Local walk(vec2 uv) {
    uint node = tree;
    // A plan's depth bounds the way down.
    for (int guard = 0; guard < 64; ++guard) {
        uint word = trees[node], kind = word & 7u, rotation = (word >> 3) & 3u;
        if (kind == NODE_INTERNAL) {
            bool right = uv.x > 0.5 || (uv.x == 0.5 && (word & 32u) == 0u);
            bool upper = uv.y > 0.5 || (uv.y == 0.5 && (word & 64u) == 0u);
            uv = 2.0 * uv - vec2(right, upper);
            node = tree + trees[node + 1u + uint(right) + 2u * uint(upper)];
        } else if (kind == NODE_TERMINAL) {
            uint rings_stored = (word >> 8) & 255u, absolute = (word >> 16) & 255u, origin = trees[node + 1u];
            uint start = word >> 25;
            uint tail = tree + trees[node + 2u], tail_kind = trees[tail] & 7u;
            uint mode = (word & NODE_HAS_MODE) != 0u ? trees[tail + 5u] : NO_POINT;
            vec2 at = turned(rotation, uv);
            uint k = 0u;
            while (k < rings_stored && at.x < 0.5 && at.y < 0.5) {
                at *= 2.0;
                ++k;
            }
            if (k < rings_stored) {
                bool offset = k >= absolute && origin != NO_POINT;
                Local l = of_ring(node + 3u + 12u * k, at, offset ? mode : NO_POINT);
                if (offset) l.at = support[points + origin].xyz + exp2(-float(start + k)) * l.at;
                return l;
            }
            if (tail_kind != NODE_EXTRAORDINARY) {
                uv = turned((4u - rotation) & 3u, at);
                node = tail;
                continue;
            }
            vec2 last = turned((trees[tail] >> 3) & 3u, turned((4u - rotation) & 3u, at));
            if (last == vec2(0.0) || rings_stored == 0u) return of_limit(tail + 1u);
            // Below the last ring everything shrinks by one ratio a level (Stam 1998).
            float ratio = reals[constants + trees[tail + 4u]];
            bool relative = rings_stored > absolute && origin != NO_POINT;
            float part = ratio * (relative ? exp2(1.0 - float(start + rings_stored)) : 1.0);
            while (last.x < 0.5 && last.y < 0.5) {
                last *= 2.0;
                part *= ratio;
            }
            Local l = of_ring(node + 3u + 12u * (rings_stored - 1u), last, relative ? mode : NO_POINT);
            vec3 limit = support[points + trees[tail + 1u]].xyz;
            l.at = limit + part * (relative ? l.at : l.at - limit);
            return l;
        } else if (kind == NODE_CREASE) {
            return of_crease(node, turned(rotation, uv));
        } else if (kind == NODE_EXTRAORDINARY) {
            return of_limit(node + 1u);
        } else if (kind == NODE_REGULAR) {
            return of_spline(node, uv);
        } else {
            return of_corners(node, uv);
        }
    }
    return Local(vec3(0.0), vec3(0.0), vec3(0.0));
}

void main() {
    Part part = parts[part_index];
    Patch p = patches[part.patch_index];
    tree = heads[p.head + HEAD_TREE];
    constants = heads[p.head + HEAD_REALS];
    points = p.support;
    vec2 uv = turned(p.rotation, part.corner + part.side * gl_TessCoord.xy);
    Local l = walk(uv);
    vec3 substitute = vec3(0.0);
    if (length(cross(l.along_u, l.along_v)) <= 1e-4 * length(l.along_u) * length(l.along_v)) {
        // No normal here by itself: that of a place a little further in, for the picture's sake.
        Local inner = walk(mix(uv, vec2(0.5), 0.015625));
        vec3 n = cross(inner.along_u, inner.along_v);
        substitute = length(n) > 0.0 ? normalize(n) : vec3(0.0);
    }
    put(vertex_at(rings[p.ring]) + l.at, l.along_u, l.along_v, substitute);
}
