// The rasterizer module with any inputs, for prove.sh: numbers are abstract, so that the controller is what is proved. A batch
// has 8 primitives.
module formal (
    input logic clk
);
    (* anyseq *) logic tile_valid, tile_mode, data_valid;
    (* anyseq *) logic [31:0] tile_address, tile_count;
    (* anyconst *) logic blocks;
    (* anyconst *) logic [1:0] saturation;
    logic reset = 1'b1;
    always_ff @(posedge clk) reset <= 1'b0;
    raster_module #(.EXPONENT(5), .MANTISSA(10), .BATCH(8)) proved (
        .clk(clk), .reset(reset), .depth_offset(16'd0), .depth_scale(16'd0), .alpha_floor(16'd0), .alpha_ceiling(16'd0),
        .transmittance_floor(16'd0), .blocks(blocks), .saturation(saturation), .tile_valid(tile_valid),
        .tile_mode(tile_mode), .tile_address(tile_address), .tile_count(tile_count), .data_valid(data_valid), .data(128'd0));
endmodule

// Computes nothing.
module pe #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int GAUSSIANS = 1,
    parameter int TWO_PATHS = 0,
    parameter int BOOTH = 0,
    parameter int POLYNOMIAL = 0
) (
    input  logic clk,
    input  logic mode,
    input  logic [EXPONENT+MANTISSA:0] x,
    input  logic [EXPONENT+MANTISSA:0] y,
    input  logic [9*(1+EXPONENT+MANTISSA)-1:0] numbers,
    input  logic [EXPONENT+MANTISSA:0] depth_offset,
    input  logic [EXPONENT+MANTISSA:0] depth_scale,
    input  logic [EXPONENT+MANTISSA:0] alpha_floor,
    input  logic [EXPONENT+MANTISSA:0] alpha_ceiling,
    input  logic [EXPONENT+MANTISSA:0] transmittance_floor,
    input  logic [EXPONENT+MANTISSA:0] transmittance,
    input  logic [3*(1+EXPONENT+MANTISSA)-1:0] color,
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] fragment,
    output logic covered,
    output logic reaches,
    output logic open,
    output logic [EXPONENT+MANTISSA:0] next_transmittance,
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] next_color
);
    assign {fragment, covered, reaches, open, next_transmittance, next_color} = 0;
endmodule

// Finishes any pixel that is written, or none.
module pixel_buffer #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23
) (
    input  logic clk,
    input  logic reset,
    input  logic [1:0] modes,
    input  logic [4:0] read_at,
    input  logic [4:0] color_at,
    output logic [EXPONENT+MANTISSA:0] transmittance,
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] color,
    input  logic write,
    input  logic [4:0] write_at,
    input  logic reaches,
    input  logic open,
    input  logic [EXPONENT+MANTISSA:0] next_transmittance,
    output logic blends,
    input  logic write_color,
    input  logic [4:0] write_color_at,
    input  logic [3*(1+EXPONENT+MANTISSA)-1:0] next_color,
    output logic [EXPONENT+MANTISSA:0] depth,
    input  logic [4:0] leave_at,
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] leaving,
    input  logic [1:0] clear,
    output logic [31:0] finished
);
    (* anyseq *) logic finishes;
    assign {transmittance, color, blends, depth, leaving} = 0;
    always_ff @(posedge clk) begin
        if (write && finishes) finished[write_at] <= 1'b1;
        for (int half = 0; half < 2; half = half + 1)
            if (clear[half] || reset) finished[half*16+:16] <= 16'b0;
    end
endmodule

// Names any groups.
module primitive_buffer #(
    parameter int BITS = 32,
    parameter int BATCH = 32,
    parameter int INDEX = 6
) (
    input  logic clk,
    input  logic begin_batch,
    input  logic fill,
    input  logic half,
    input  logic [127:0] data,
    input  logic [INDEX-1:0] at,
    output logic [9*BITS-1:0] numbers,
    input  logic [INDEX-1:0] next_at,
    output logic [15:0] next_groups
);
    (* anyseq *) logic [15:0] groups;
    assign numbers = 0;
    assign next_groups = groups;
endmodule
