// The pixels of a PE: 16 of each of two tiles. Of Gaussians colour and transmittance, of triangles u, v and depth in the
// place of colour. A pixel that nothing has touched since its tile began has the values that tiles begin with.
module pixel_buffer #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23
) (
    input  logic clk,
    input  logic reset,
    // Of each tile: 1 for Gaussians.
    input  logic [1:0] modes,
    // Of a pixel that READs, at an addition before GAUSSIAN and at TRIANGLE: tile and group.
    input  logic [4:0] read_at,
    input  logic [4:0] color_at,
    output logic [EXPONENT+MANTISSA:0] transmittance,
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] color,
    // Of a pixel at WRITE.
    input  logic write,
    input  logic [4:0] write_at,
    input  logic reaches,
    input  logic open,
    input  logic [EXPONENT+MANTISSA:0] next_transmittance,
    // Whether it took the Gaussian, as its colour follows.
    output logic blends,
    // Of a pixel at GAUSSIAN or TRIANGLE.
    input  logic write_color,
    input  logic [4:0] write_color_at,
    input  logic [3*(1+EXPONENT+MANTISSA)-1:0] next_color,
    output logic [EXPONENT+MANTISSA:0] depth,
    // What leaves for memory, and then begins anew.
    input  logic [4:0] leave_at,
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] leaving,
    input  logic [1:0] clear,
    output logic [31:0] finished
);
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    localparam logic [BITS-1:0] ONE = {2'b00, {(EXPONENT-1){1'b1}}, {MANTISSA{1'b0}}};
    localparam logic [BITS-1:0] GREATEST = {1'b0, {(EXPONENT-1){1'b1}}, 1'b0, {MANTISSA{1'b1}}};

    logic [BITS-1:0] transmittances [0:31];
    logic [3*BITS-1:0] colors [0:31];
    logic [31:0] dimmed, colored;
    logic [3*BITS-1:0] fresh;
    assign fresh = modes[leave_at[4]] ? {(3*BITS){1'b0}} : {GREATEST, {(2*BITS){1'b0}}};

    assign transmittance = dimmed[read_at] ? transmittances[read_at] : ONE;
    assign color = colored[color_at] ? colors[color_at] : {(3*BITS){1'b0}};
    assign depth = colored[write_color_at] ? colors[write_color_at][2*BITS+:BITS] : GREATEST;
    assign leaving = colored[leave_at] ? colors[leave_at] : fresh;
    assign blends = write && !finished[write_at] && reaches && open;

    always_ff @(posedge clk) begin
        if (blends) begin
            transmittances[write_at] <= next_transmittance;
            dimmed[write_at] <= 1'b1;
        end
        if (write && reaches && !open)
            finished[write_at] <= 1'b1;
        if (write_color) begin
            colors[write_color_at] <= next_color;
            colored[write_color_at] <= 1'b1;
        end
        for (int half = 0; half < 2; half = half + 1)
            if (clear[half] || reset) begin
                dimmed[half*16+:16] <= 16'b0;
                colored[half*16+:16] <= 16'b0;
                finished[half*16+:16] <= 16'b0;
            end
    end
endmodule
