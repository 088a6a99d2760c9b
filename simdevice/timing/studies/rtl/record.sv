// Writes what enters and what leaves the first PE of a module to record.txt: the names of its ports, then their values in each
// cycle. The first value tells whether a pixel begins. For Verilator, beside the module's files.
module record #(
    parameter int BITS = 32
) (
    input logic clk,
    input logic issue,
    input logic mode,
    input logic [BITS-1:0] x,
    input logic [BITS-1:0] y,
    input logic [9*BITS-1:0] numbers,
    input logic [BITS-1:0] depth_offset,
    input logic [BITS-1:0] depth_scale,
    input logic [BITS-1:0] alpha_floor,
    input logic [BITS-1:0] alpha_ceiling,
    input logic [BITS-1:0] transmittance_floor,
    input logic [BITS-1:0] transmittance,
    input logic [3*BITS-1:0] color,
    input logic [3*BITS-1:0] fragment,
    input logic covered,
    input logic reaches,
    input logic open,
    input logic [BITS-1:0] next_transmittance,
    input logic [3*BITS-1:0] next_color
);
    integer file;
    initial begin
        file = $fopen("record.txt", "w");
        $fwrite(file, "issue mode x y numbers depth_offset depth_scale alpha_floor alpha_ceiling transmittance_floor ");
        $fwrite(file, "transmittance color fragment covered reaches open next_transmittance next_color\n");
    end
    always @(posedge clk)
        $fwrite(file, "%h %h %h %h %h %h %h %h %h %h %h %h %h %h %h %h %h %h\n", issue, mode, x, y, numbers, depth_offset,
                depth_scale, alpha_floor, alpha_ceiling, transmittance_floor, transmittance, color, fragment, covered, reaches, open,
                next_transmittance, next_color);
endmodule

bind raster_module record #(.BITS(BITS)) recorder (
    .clk(clk), .issue(issue), .mode(mode), .x(lanes[0].x), .y(lanes[0].y), .numbers(used), .depth_offset(depth_offset),
    .depth_scale(depth_scale), .alpha_floor(alpha_floor), .alpha_ceiling(alpha_ceiling),
    .transmittance_floor(transmittance_floor), .transmittance(lanes[0].transmittance), .color(lanes[0].color),
    .fragment(lanes[0].fragment), .covered(lanes[0].covered), .reaches(lanes[0].reaches), .open(lanes[0].open),
    .next_transmittance(lanes[0].next_transmittance), .next_color(lanes[0].next_color));
