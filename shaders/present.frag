// A finished picture, as the window shows it: exposure, tone curve, sRGB; over a chequered ground where it is clear.

#define CLIP 0
#define REINHARD 1
#define FILMIC 2

#include "lib/color.glsl"

uniform sampler2D picture;
uniform vec2 corner;  // of the picture in the window, lower left, in pixels
uniform vec2 shown_size;  // of the picture, in pixels
uniform float gain;

out vec4 color;

const float REINHARD_WHITE = 4.0;
const float SQUARE = 12.0;  // pixels

void main() {
    vec4 c = texture(picture, (gl_FragCoord.xy - corner) / shown_size);
    vec3 lit = max(c.rgb * gain, 0.0);
#if TONE == CLIP
    vec3 curved = lit;
#elif TONE == REINHARD
    vec3 curved = reinhard(lit, REINHARD_WHITE);
#elif TONE == FILMIC
    vec3 curved = filmic(lit);
#else
#error "TONE must be CLIP, REINHARD or FILMIC"
#endif
    vec3 shown = srgb_from_linear(clamp(curved, 0.0, 1.0));
    if (any(isnan(c.rgb))) shown = vec3(1.0, 0.0, 1.0);
    vec2 cell = mod(floor(gl_FragCoord.xy / SQUARE), 2.0);
    vec3 ground = vec3(cell.x == cell.y ? 0.30 : 0.36);
    color = vec4(mix(ground, shown, clamp(c.a, 0.0, 1.0)), 1.0);
}
