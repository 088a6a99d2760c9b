// Chooses a port that is valid: the first behind the one whose turn was last. A choice stays until what it carries moves.
module round_robin #(
    // A power of two.
    parameter int PORTS = 4
) (
    input  logic clk,
    input  logic reset,
    input  logic [PORTS-1:0] valid,
    input  logic moves,
    output logic any,
    output logic [$clog2(PORTS)-1:0] chosen
);
    localparam int PORT = $clog2(PORTS);
    logic [PORT-1:0] turn, kept, next;
    logic keeps;
    always_comb begin
        next = turn;
        for (int i = PORTS - 1; i >= 0; i = i - 1)
            if (valid[turn + PORT'(i)]) next = turn + PORT'(i);
    end
    assign any = |valid;
    assign chosen = keeps ? kept : next;
    always_ff @(posedge clk) begin
        keeps <= any && !moves;
        kept <= chosen;
        if (moves) turn <= chosen + 1'b1;
        if (reset) begin
            keeps <= 1'b0;
            turn <= 0;
        end
    end
endmodule
