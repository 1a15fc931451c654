// Light on what geometry.frag.glsl found. A pixel whose four samples lie on one smooth piece of surface is
// shaded once, others at every sample.
//
// All light comes from light_count directions: samples of the discs of key, fill and rim light, then of the
// sky. Each has a shadow map, so that their sum has soft shadows and the sky's occlusion. Linear light in and
// out.
uniform sampler2DMS place_map;
uniform sampler2DMS facing_map;
uniform sampler2DMS material_map;
uniform sampler2DArrayShadow shadows;
uniform vec3 light_direction[LIGHTS];
uniform vec3 light_radiance[LIGHTS];
uniform vec4 light_rows[3 * LIGHTS];
uniform int light_count;  // LIGHTS, but unknown to the compiler, which would unroll the loop
uniform int lamp_count;   // the first ones are lamps (they glint), the others are sky
uniform int has_shadows;
uniform float shadow_offset;
uniform float radius;  // of all that is drawn
uniform vec3 eye;
uniform vec3 up;
uniform vec3 sky_zenith;
uniform vec3 sky_horizon;
uniform vec3 sky_ground;
uniform float exposure;
uniform vec3 back_colour;
uniform int use_back_colour;
uniform int show_normals;
uniform float gloss;
uniform float specular;
uniform vec3 wire_colour;
uniform vec3 ground_centre;
uniform float ground_fade;  // distance at which the ground has become background
uniform vec3 background_top;
uniform vec3 background_bottom;
uniform float background_alpha;
uniform float height;
out vec4 result;

const float pi = 3.14159265;

float visibility(int light, vec3 p) {
    if (has_shadows == 0) return 1.0;
    vec4 q = vec4(p, 1.0);
    vec3 s = vec3(dot(light_rows[3 * light], q), dot(light_rows[3 * light + 1], q),
                  dot(light_rows[3 * light + 2], q));
    float lit = texture(shadows, vec4(0.5 * s.xy + 0.5, float(light), 0.5 * s.z + 0.5));
    return any(greaterThan(abs(s), vec3(0.999))) ? 1.0 : lit;
}

// GGX lobe times the geometry term, by Karis' approximation.
float glint(float nl, float nv, float nh, float roughness) {
    float a = roughness * roughness, a2 = a * a;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float k = 0.5 * a;
    return a2 / (pi * d * d) * 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
}

vec4 background() {
    float t = smoothstep(0.0, 1.0, gl_FragCoord.y / height);
    return vec4(mix(background_bottom, background_top, t), 1.0) * background_alpha;
}

vec4 shade(vec3 at, float kind, vec3 n, vec3 colour) {
    if (show_normals != 0 && kind > 1.5) {
        vec3 s = 0.5 * n + 0.5;  // as sRGB values, so that a PNG holds them as they are
        return vec4(mix(s / 12.92, pow((s + 0.055) / 1.055, vec3(2.4)), greaterThan(s, vec3(0.04045))), 1.0);
    }
    vec3 v = normalize(eye - at), p = at + shadow_offset * n;
    float roughness = mix(0.75, 0.12, gloss), nv = max(dot(n, v), 1e-3), f0 = 0.08 * specular;
    vec3 diffuse = vec3(0.0), unshadowed = vec3(1e-6), shine = vec3(0.0), seen = vec3(0.0), sky = vec3(1e-6);
    for (int k = 0; k < light_count; k++) {
        vec3 l = light_direction[k];
        float nl = dot(n, l);
        vec3 open = light_radiance[k] * max(nl, 0.0), e = open * visibility(k, p);
        diffuse += e;
        unshadowed += open;
        if (k < lamp_count) {
            vec3 h = normalize(l + v);
            float fresnel = f0 + (1.0 - f0) * pow(1.0 - max(dot(h, v), 0.0), 5.0);
            shine += e * pi * fresnel * glint(max(nl, 0.0), nv, max(dot(n, h), 0.0), roughness);
        } else {
            seen += e;
            sky += light_radiance[k] * abs(nl);
        }
    }
    if (kind < 1.5) {
        // Close by the ground's own colour; far away the background, darkened by what shadow is left.
        vec4 far = background();
        float fade = smoothstep(0.25, 1.0, distance(at, ground_centre) / ground_fade);
        return mix(vec4(colour * diffuse * exposure, 1.0), vec4(far.rgb * diffuse / unshadowed, far.a), fade);
    }
    if (kind > 2.5 && use_back_colour != 0) colour = back_colour;
    // Light from below, and what a polished surface mirrors of the sky.
    float openness = clamp(dot(seen, vec3(1.0)) / dot(sky, vec3(1.0)) * 1.3, 0.0, 1.0);
    diffuse += sky_ground * 0.175 * (1.0 - dot(n, up)) * (0.3 + 0.7 * openness);
    vec3 r = reflect(-v, n);
    float rise = dot(r, up);
    vec3 mirrored = rise > 0.0 ? mix(sky_horizon, sky_zenith, sqrt(rise))
                               : mix(sky_horizon * 0.8, sky_ground, min(-3.0 * rise, 1.0));
    float fresnel = f0 + (max(1.0 - roughness, f0) - f0) * pow(1.0 - nv, 5.0);
    vec3 light = colour * diffuse + specular * shine + mirrored * fresnel * openness * (0.4 + 0.6 * gloss);
    return vec4(min(light * exposure, vec3(8.0)), 1.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 place[4], facing[4], material[4];
    vec4 mean_place = vec4(0.0), mean_facing = vec4(0.0), mean_material = vec4(0.0);
    for (int s = 0; s < 4; s++) {
        place[s] = texelFetch(place_map, pixel, s);
        facing[s] = texelFetch(facing_map, pixel, s);
        material[s] = texelFetch(material_map, pixel, s);
        mean_place += 0.25 * place[s];
        mean_facing += 0.25 * facing[s];
        mean_material += 0.25 * material[s];
    }
    bool one = true;
    for (int s = 0; s < 4; s++) {
        vec3 n = facing[0].xyz;
        one = one && place[s].w == place[0].w && dot(n, facing[s].xyz) > 0.98 * dot(n, n) &&
              abs(dot(n, place[s].xyz - place[0].xyz)) < 4e-3 * radius &&
              distance(material[s].rgb, material[0].rgb) < 0.02;
    }
    one = one || mean_place.w == 0.0;
    result = vec4(0.0);
    int count = mean_place.w == 0.0 ? 0 : one ? 1 : 4;
    for (int s = 0; s < count; s++) {
        vec4 here = one ? mean_place : place[s];
        vec4 normal = one ? vec4(normalize(mean_facing.xyz), mean_facing.w) : facing[s];
        vec4 own = one ? mean_material : material[s];
        if (here.w == 0.0) {
            result += background();
            continue;
        }
        vec4 light = shade(here.xyz, here.w, normal.xyz, own.rgb);
        light.rgb = mix(light.rgb, wire_colour, 0.75 * own.a);
        light.rgb = mix(light.rgb, vec3(0.01), 0.8 * normal.w);
        result += light;
    }
    result = count == 0 ? background() : result / float(count);
}
