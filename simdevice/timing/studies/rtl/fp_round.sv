// Rounds a significand with EXTRA bits below the mantissa to nearest, ties to even, and packs it. Too small a number is
// zero, too large a one the greatest. The leading one stands at bit MANTISSA + EXTRA; `zero` says that there is none.
module fp_round #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int EXTRA = 3
) (
    input  logic sign,
    input  logic signed [EXPONENT+1:0] exponent,
    input  logic [MANTISSA+EXTRA:0] significand,
    input  logic zero,
    output logic [EXPONENT+MANTISSA:0] number
);
    localparam logic signed [EXPONENT+1:0] TOP = (1 << EXPONENT) - 1;
    logic up, carry;
    logic [MANTISSA+1:0] rounded;
    logic signed [EXPONENT+1:0] raised;

    assign up = significand[EXTRA-1] && (|significand[EXTRA-2:0] || significand[EXTRA]);
    assign rounded = {1'b0, significand[MANTISSA+EXTRA:EXTRA]} + {{(MANTISSA+1){1'b0}}, up};
    assign carry = rounded[MANTISSA+1];
    assign raised = exponent + $signed({{(EXPONENT+1){1'b0}}, carry});
    always_comb begin
        // After a carry the mantissa is zero either way.
        number = {sign, raised[EXPONENT-1:0], rounded[MANTISSA-1:0]};
        if (zero || raised <= 0)
            number = {sign, {(EXPONENT+MANTISSA){1'b0}}};
        else if (raised >= TOP)
            number = {sign, {(EXPONENT-1){1'b1}}, 1'b0, {MANTISSA{1'b1}}};
    end
endmodule
