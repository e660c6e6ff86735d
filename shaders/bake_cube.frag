// A lat-long picture to faces of a cube, from first_face on, one above the other: target N wide and 6 N high, or N x N.
// Each texel is the mean of across x across bilinear reads.

#include "environment_input.glsl"

uniform int first_face;
uniform int face_size;
uniform int across;

out vec4 color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int face = at.y / face_size;
    vec2 corner = vec2(at.x, at.y - face * face_size);
    face += first_face;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < across * across; i++) {
        vec2 within = (vec2(i % across, i / across) + 0.5) / float(across);
        vec2 place = latlong_uv(cube_dir(face, (corner + within) / float(face_size)));
#if ENVIRONMENT_BORDER
        place = place * border.xy + border.zw;
#endif
        sum += textureLod(environment, place, 0.0).rgb;
    }
    color = vec4(sum / float(across * across), 1.0);
}
