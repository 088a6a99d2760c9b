// Several rasterizer modules that share one memory through the arbiter. Ports are those of raster_module. A tile goes to a
// module that is ready, `tile_to`, in turns; a module writes its tiles in the order in which it took them, and `write_from`
// is the module whose pixels are written.
module rasterizer #(
    // A power of two.
    parameter int MODULES = 4,
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int BATCH = 32,
    parameter int PIECE = 8,
    parameter int TWO_PATHS = 0,
    parameter int BOOTH = 0,
    parameter int POLYNOMIAL = 0
) (
    input  logic clk,
    input  logic reset,
    input  logic [EXPONENT+MANTISSA:0] depth_offset,
    input  logic [EXPONENT+MANTISSA:0] depth_scale,
    input  logic [EXPONENT+MANTISSA:0] alpha_floor,
    input  logic [EXPONENT+MANTISSA:0] alpha_ceiling,
    input  logic [EXPONENT+MANTISSA:0] transmittance_floor,
    input  logic blocks,
    input  logic [1:0] saturation,
    input  logic tile_valid,
    output logic tile_ready,
    input  logic tile_mode,
    input  logic [31:0] tile_address,
    input  logic [31:0] tile_count,
    output logic [$clog2(MODULES)-1:0] tile_to,
    output logic request_valid,
    input  logic request_ready,
    output logic [31:0] request_address,
    output logic [15:0] request_beats,
    input  logic data_valid,
    output logic data_ready,
    input  logic [127:0] data,
    output logic write_valid,
    input  logic write_ready,
    output logic [127:0] write_data,
    output logic [$clog2(MODULES)-1:0] write_from,
    output logic [3*MODULES-1:0] cause,
    output logic [MODULES-1:0] in_flight,
    output logic idle
);
    logic [MODULES-1:0] takes_tile, asks, asks_ready, receives, receives_ready, writes, writes_ready, idles;
    logic [MODULES*32-1:0] addresses;
    logic [MODULES*16-1:0] beats;
    logic [MODULES*128-1:0] written;

    assign idle = &idles;
    round_robin #(.PORTS(MODULES)) tiles (
        .clk(clk), .reset(reset), .valid(takes_tile), .moves(tile_valid && tile_ready), .any(tile_ready), .chosen(tile_to));
    generate
        for (genvar m = 0; m < MODULES; m = m + 1) begin : modules
            raster_module #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .BATCH(BATCH), .PIECE(PIECE),
                            .TWO_PATHS(TWO_PATHS), .BOOTH(BOOTH), .POLYNOMIAL(POLYNOMIAL)) module_of_it (
                .clk(clk), .reset(reset), .depth_offset(depth_offset), .depth_scale(depth_scale),
                .alpha_floor(alpha_floor), .alpha_ceiling(alpha_ceiling), .transmittance_floor(transmittance_floor),
                .blocks(blocks), .saturation(saturation),
                .tile_valid(tile_valid && 32'(tile_to) == m), .tile_ready(takes_tile[m]), .tile_mode(tile_mode),
                .tile_address(tile_address), .tile_count(tile_count),
                .request_valid(asks[m]), .request_ready(asks_ready[m]), .request_address(addresses[m*32+:32]),
                .request_beats(beats[m*16+:16]), .data_valid(receives[m]), .data_ready(receives_ready[m]), .data(data),
                .write_valid(writes[m]), .write_ready(writes_ready[m]), .write_data(written[m*128+:128]),
                .cause(cause[m*3+:3]), .in_flight(in_flight[m]), .idle(idles[m]));
        end
    endgenerate
    arbiter #(.PORTS(MODULES), .REQUESTS(MODULES * 2 * BATCH / PIECE)) shares_memory (
        .clk(clk), .reset(reset), .request_valid(asks), .request_ready(asks_ready), .request_address(addresses),
        .request_beats(beats), .data_valid(receives), .data_ready(receives_ready), .write_valid(writes),
        .write_ready(writes_ready), .write_data(written), .memory_request_valid(request_valid),
        .memory_request_ready(request_ready), .memory_request_address(request_address),
        .memory_request_beats(request_beats), .memory_data_valid(data_valid), .memory_data_ready(data_ready),
        .memory_write_valid(write_valid), .memory_write_ready(write_ready), .memory_write_data(write_data),
        .write_from(write_from));
endmodule
