// WebGL 2 by numbers: each function returns what differs from the expected numbers, or nothing.
const gl = document.createElement('canvas').getContext('webgl2');

function program(vertex, fragment, varyings) {
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, `#version 300 es\nprecision highp float;\nprecision highp int;\n${source}`);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    if (varyings) gl.transformFeedbackVaryings(program, varyings, gl.SEPARATE_ATTRIBS);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw gl.getProgramInfoLog(program);
    gl.useProgram(program);
    return program;
}

function target(format, width, height) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.viewport(0, 0, width, height);
}

// The square that covers the viewport, as a strip without attributes.
const COVER = 'void main() { gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 0.5) * 4.0 - 2.0; gl_Position.w = 2.0; }';

function different(found, expected) {
    for (let i = 0; i < found.length; i += 1) {
        if (found[i] !== expected(i)) return `number ${i} is ${found[i]}, not ${expected(i)}`;
    }
}

export const checks = {
    // 10,000 integers of a vertex shader.
    transformFeedback() {
        const count = 10000;
        program('flat out uint n; void main() { n = uint(gl_VertexID) * 2654435761u; n ^= n >> 7; }', 'out vec4 c; void main() {}', ['n']);
        const buffer = gl.createBuffer();
        gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, buffer);
        gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, 4 * count, gl.STREAM_READ);
        gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, gl.createTransformFeedback());
        gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
        gl.enable(gl.RASTERIZER_DISCARD);
        gl.beginTransformFeedback(gl.POINTS);
        gl.drawArrays(gl.POINTS, 0, count);
        gl.endTransformFeedback();
        gl.disable(gl.RASTERIZER_DISCARD);
        gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
        gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, buffer);
        const found = new Uint32Array(count);
        gl.getBufferSubData(gl.TRANSFORM_FEEDBACK_BUFFER, 0, found);
        return different(found, (i) => {
            const n = Math.imul(i, 2654435761) >>> 0;
            return (n ^ (n >>> 7)) >>> 0;
        });
    },

    // Pixels of integers, each of its own coordinates.
    integerTarget() {
        target(gl.R32UI, 64, 64);
        program(COVER, 'out uint n; void main() { uvec2 p = uvec2(gl_FragCoord.xy); n = p.y << 16 | p.x; }');
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
        const found = new Uint32Array(64 * 64);
        gl.readPixels(0, 0, 64, 64, gl.RED_INTEGER, gl.UNSIGNED_INT, found);
        return different(found, (i) => ((i >> 6) << 16) | (i & 63));
    },

    // Blended floats: 64 layers of 1/64.
    blendedFloats() {
        gl.getExtension('EXT_color_buffer_float');
        gl.getExtension('EXT_float_blend');
        target(gl.RGBA32F, 16, 16);
        program(COVER, 'out vec4 c; void main() { c = vec4(1.0 / 64.0); }');
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, 64);
        gl.disable(gl.BLEND);
        const found = new Float32Array(4 * 16 * 16);
        gl.readPixels(0, 0, 16, 16, gl.RGBA, gl.FLOAT, found);
        return different(found, () => 1);
    },

    // A linear filter between two texels.
    filteredTexture() {
        target(gl.RGBA8, 3, 1);
        gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 2, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array([0, 0, 0, 0, 200, 200, 200, 200]));
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
        const drawn = program(COVER, 'uniform sampler2D t; out vec4 c; void main() { c = texture(t, vec2((gl_FragCoord.x + 0.5) / 4.0, 0.5)); }');
        gl.uniform1i(gl.getUniformLocation(drawn, 't'), 0);
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
        const found = new Uint8Array(12);
        gl.readPixels(0, 0, 3, 1, gl.RGBA, gl.UNSIGNED_BYTE, found);
        return different(found, (i) => [0, 100, 200][i >> 2]);
    },

    // Half of a pixel's four samples.
    fourSamples() {
        target(gl.RGBA8, 4, 4);
        const resolved = gl.getParameter(gl.FRAMEBUFFER_BINDING);
        gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
        const samples = gl.createRenderbuffer();
        gl.bindRenderbuffer(gl.RENDERBUFFER, samples);
        gl.renderbufferStorageMultisample(gl.RENDERBUFFER, 4, gl.RGBA8, 4, 4);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, samples);
        gl.clearColor(0, 0, 0, 0);
        gl.clear(gl.COLOR_BUFFER_BIT);
        // The left half of the third column of pixels, and what is left of it.
        program('void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * vec2(1.25, 2.0) - 1.0, 0, 1); }', 'out vec4 c; void main() { c = vec4(1); }');
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, resolved);
        gl.blitFramebuffer(0, 0, 4, 4, 0, 0, 4, 4, gl.COLOR_BUFFER_BIT, gl.NEAREST);
        gl.bindFramebuffer(gl.FRAMEBUFFER, resolved);
        const found = new Uint8Array(64);
        gl.readPixels(0, 0, 4, 4, gl.RGBA, gl.UNSIGNED_BYTE, found);
        return different(found, (i) => [255, 255, 128, 0][(i >> 2) & 3]);
    },
};
