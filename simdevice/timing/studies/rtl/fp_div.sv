// The quotient of two numbers: restoring division, two bits of the quotient in a cycle. A new pair may begin in each cycle.
module fp_div #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23
) (
    input  logic clk,
    input  logic [EXPONENT+MANTISSA:0] a,
    input  logic [EXPONENT+MANTISSA:0] b,
    output logic [EXPONENT+MANTISSA:0] quotient
);
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    localparam int SIZE = MANTISSA + 1;
    localparam int BIAS = (1 << (EXPONENT - 1)) - 1;
    // The leading one, the mantissa and a guard bit.
    localparam int STEPS = MANTISSA + 2;
    localparam int STAGES = (STEPS + 1) / 2;

    // Between the stages: what is left of the numerator, the denominator, and the quotient's bits so far.
    logic [(STAGES+1)*(SIZE+1)-1:0] rest;
    logic [(STAGES+1)*SIZE-1:0] denominator;
    logic [(STAGES+1)*STEPS-1:0] bits;

    // The first cycle: a numerator of one to two denominators.
    logic less;
    logic [SIZE-1:0] x, y;
    assign x = {1'b1, a[MANTISSA-1:0]};
    assign y = {1'b1, b[MANTISSA-1:0]};
    assign less = x < y;
    always_ff @(posedge clk) begin
        rest[SIZE:0] <= less ? {x, 1'b0} : {1'b0, x};
        denominator[SIZE-1:0] <= y;
        bits[STEPS-1:0] <= 0;
    end

    generate
        for (genvar stage = 0; stage < STAGES; stage = stage + 1) begin : stages
            logic [SIZE:0] left;
            logic [SIZE-1:0] by;
            logic [STEPS-1:0] found;
            always_comb begin
                left = rest[stage*(SIZE+1)+:SIZE+1];
                by = denominator[stage*SIZE+:SIZE];
                found = bits[stage*STEPS+:STEPS];
                for (int step = 0; step < 2; step = step + 1)
                    if (2 * stage + step < STEPS) begin
                        if (left >= {1'b0, by}) begin
                            found = {found[STEPS-2:0], 1'b1};
                            left = left - {1'b0, by};
                        end else
                            found = {found[STEPS-2:0], 1'b0};
                        left = left << 1;
                    end
            end
            always_ff @(posedge clk) begin
                rest[(stage+1)*(SIZE+1)+:SIZE+1] <= left;
                denominator[(stage+1)*SIZE+:SIZE] <= by;
                bits[(stage+1)*STEPS+:STEPS] <= found;
            end
        end
    endgenerate

    logic signed [EXPONENT+1:0] exponent;
    logic sign, zero, by_zero;
    delay #(.WIDTH(EXPONENT + 5), .CYCLES(STAGES + 1)) beside (
        .clk(clk),
        .in({$signed({2'b00, a[BITS-2:MANTISSA]}) - $signed({2'b00, b[BITS-2:MANTISSA]}) + BIAS[EXPONENT+1:0]
             - $signed({{(EXPONENT+1){1'b0}}, less}),
             a[BITS-1] ^ b[BITS-1], a[BITS-2:MANTISSA] == 0, b[BITS-2:MANTISSA] == 0}),
        .out({exponent, sign, zero, by_zero}));

    // The last cycle: rounding; a rest is a sticky bit.
    logic [BITS-1:0] number;
    fp_round #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .EXTRA(2)) round (
        .sign(sign), .exponent(exponent),
        .significand({bits[STAGES*STEPS+:STEPS], rest[STAGES*(SIZE+1)+:SIZE+1] != 0}),
        .zero(zero), .number(number));
    always_ff @(posedge clk)
        quotient <= by_zero && !zero ? {sign, {(EXPONENT-1){1'b1}}, 1'b0, {MANTISSA{1'b1}}} : number;
endmodule
