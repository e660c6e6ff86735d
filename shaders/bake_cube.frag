// A lat-long picture to the six faces of a cube, one above the other: target N wide, 6 N high.

#include "environment_input.glsl"

uniform int face_size;

out vec4 color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int face = at.y / face_size;
    vec2 st = (vec2(at.x, at.y - face * face_size) + 0.5) / float(face_size);
    vec2 place = latlong_uv(cube_dir(face, st));
#if ENVIRONMENT_BORDER
    place = place * border.xy + border.zw;
#endif
    color = vec4(textureLod(environment, place, 0.0).rgb, 1.0);
}
