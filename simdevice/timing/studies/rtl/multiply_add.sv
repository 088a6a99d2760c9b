// The product of two integers and an addend. Registers hold the products with the thirds of the second one; the sum is
// behind them, so that the addend comes a cycle after the factors.
module multiply_add #(
    parameter int LEFT = 24,
    parameter int RIGHT = 24,
    parameter int SUM = LEFT + RIGHT
) (
    input  logic clk,
    input  logic [LEFT-1:0] a,
    input  logic [RIGHT-1:0] b,
    input  logic [SUM-1:0] addend,
    output logic [SUM-1:0] sum
);
    localparam int THIRD = (RIGHT + 2) / 3;
    localparam int LAST = RIGHT - 2 * THIRD;
    logic [LEFT+THIRD-1:0] low, middle;
    logic [LEFT+LAST-1:0] high;
    always_ff @(posedge clk) begin
        low <= {{THIRD{1'b0}}, a} * {{LEFT{1'b0}}, b[THIRD-1:0]};
        middle <= {{THIRD{1'b0}}, a} * {{LEFT{1'b0}}, b[THIRD+:THIRD]};
        high <= {{LAST{1'b0}}, a} * {{LEFT{1'b0}}, b[RIGHT-1:2*THIRD]};
    end
    assign sum = (SUM'(high) << (2 * THIRD)) + (SUM'(middle) << THIRD) + SUM'(low) + addend;
endmodule
