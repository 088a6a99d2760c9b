// The rasterizer module with any inputs, for prove.sh. A buffer has 8 primitives, and so has a piece.
module formal (
    input logic clk
);
    (* anyseq *) logic tile_valid, tile_mode, request_ready, data_valid, write_ready;
    (* anyseq *) logic [31:0] tile_address, tile_count;
    (* anyconst *) logic blocks;
    (* anyconst *) logic [1:0] saturation;
    logic reset = 1'b1;
    always_ff @(posedge clk) reset <= 1'b0;
    raster_module #(.EXPONENT(5), .MANTISSA(10), .BATCH(8)) proved (
        .clk(clk), .reset(reset), .depth_offset(16'd0), .depth_scale(16'd0), .alpha_floor(16'd0), .alpha_ceiling(16'd0),
        .transmittance_floor(16'd0), .blocks(blocks), .saturation(saturation), .tile_valid(tile_valid),
        .tile_mode(tile_mode), .tile_address(tile_address), .tile_count(tile_count), .request_ready(request_ready), .data_valid(data_valid),
        .data(128'd0), .write_ready(write_ready));
endmodule
