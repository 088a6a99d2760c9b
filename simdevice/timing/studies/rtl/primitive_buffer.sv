// Tile buffers A and B: two batches of primitives, of which one is evaluated while the other comes in. A primitive is an
// entry of its list (the groups of pixels that it is evaluated in, 32 bits) and nine numbers, without gaps between them.
module primitive_buffer #(
    parameter int BITS = 32,
    parameter int BATCH = 32,
    parameter int INDEX = 6
) (
    input  logic clk,
    // 16 bytes of a batch.
    input  logic begin_batch,
    input  logic fill,
    input  logic half,
    input  logic [127:0] data,
    // A primitive, and the groups of another.
    input  logic [INDEX-1:0] at,
    output logic [9*BITS-1:0] numbers,
    input  logic [INDEX-1:0] next_at,
    output logic [15:0] next_groups
);
    // In units of 16 bits.
    localparam int ROW = 2 + 9 * BITS / 16;
    localparam int HOLD = ROW + 7;

    logic [9*BITS-1:0] rows [0:2*BATCH-1];
    logic [15:0] groups [0:2*BATCH-1];
    logic [HOLD*16-1:0] held, with_data;
    logic [4:0] units;
    logic [INDEX-2:0] place;
    logic whole;

    assign numbers = rows[at];
    assign next_groups = groups[next_at];
    assign with_data = held | ({{(HOLD*16-128){1'b0}}, data} << {units, 4'b0000});
    assign whole = {1'b0, units} + 8 >= ROW;
    always_ff @(posedge clk) begin
        if (begin_batch) begin
            held <= 0;
            units <= 0;
            place <= 0;
        end else if (fill) begin
            if (whole) begin
                groups[{half, place}] <= with_data[15:0];
                rows[{half, place}] <= with_data[32+:9*BITS];
                held <= with_data >> (ROW * 16);
                units <= units + 5'd8 - ROW[4:0];
                place <= place + 1;
            end else begin
                held <= with_data;
                units <= units + 5'd8;
            end
        end
    end
endmodule
