// Triangles of text and of panels, in pixels of the window: x right, y down.

uniform vec2 window_size;

in vec2 place;
in vec2 texcoord;
in vec4 tint;  // sRGB-encoded, straight alpha

out vec2 at;
out vec4 colour;

void main() {
    at = texcoord;
    colour = tint;
    gl_Position = vec4(2.0 * place.x / window_size.x - 1.0, 1.0 - 2.0 * place.y / window_size.y, 0.0, 1.0);
}
