// Colour times coverage, as sums of samples have it, to straight alpha.

uniform sampler2D premultiplied;

out vec4 color;

void main() {
    vec4 c = texelFetch(premultiplied, ivec2(gl_FragCoord.xy), 0);
    color = c.a > 0.0 ? vec4(c.rgb / c.a, c.a) : vec4(0.0);
}
