// The product of two numbers, 3 cycles later: the significands' product takes two of them, rounding one. Two designs: the
// synthesizer's own multiplier, or radix-4 Booth recoding with a carry-save array.
module fp_mul #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int BOOTH = 0
) (
    input  logic clk,
    input  logic [EXPONENT+MANTISSA:0] a,
    input  logic [EXPONENT+MANTISSA:0] b,
    output logic [EXPONENT+MANTISSA:0] product
);
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    localparam int SIZE = MANTISSA + 1;
    localparam int BIAS = (1 << (EXPONENT - 1)) - 1;

    logic zero;
    logic [SIZE-1:0] x, y;
    assign zero = a[BITS-2:MANTISSA] == 0 || b[BITS-2:MANTISSA] == 0;
    assign x = {1'b1, a[MANTISSA-1:0]};
    assign y = {1'b1, b[MANTISSA-1:0]};

    // Cycles 1 and 2: the significands.
    logic [2*SIZE-1:0] whole2;
    generate
        if (BOOTH == 0) begin : plain
            logic [2*SIZE-1:0] whole1;
            always_ff @(posedge clk) begin
                whole1 <= {{SIZE{1'b0}}, x} * {{SIZE{1'b0}}, y};
                whole2 <= whole1;
            end
        end else begin : booth
            localparam int ROWS = SIZE / 2 + 1;
            localparam int WIDE = 2 * SIZE + 2;
            logic [2*ROWS:0] digits;
            logic [WIDE-1:0] row, sums, carries, next, sums1, carries1;
            assign digits = {{(2*ROWS-SIZE){1'b0}}, y, 1'b0};
            always_comb begin
                sums = 0;
                carries = 0;
                row = 0;
                next = 0;
                for (int i = 0; i < ROWS; i = i + 1) begin
                    // A digit of -2 to 2 from three bits.
                    case (digits[2*i+:3])
                        3'd1, 3'd2: row = {{(WIDE-SIZE){1'b0}}, x};
                        3'd3: row = {{(WIDE-SIZE-1){1'b0}}, x, 1'b0};
                        3'd4: row = ~{{(WIDE-SIZE-1){1'b0}}, x, 1'b0} + 1;
                        3'd5, 3'd6: row = ~{{(WIDE-SIZE){1'b0}}, x} + 1;
                        default: row = 0;
                    endcase
                    row = row << (2 * i);
                    next = sums ^ carries ^ row;
                    carries = ((sums & carries) | (sums & row) | (carries & row)) << 1;
                    sums = next;
                end
            end
            always_ff @(posedge clk) begin
                sums1 <= sums;
                carries1 <= carries;
                whole2 <= sums1[2*SIZE-1:0] + carries1[2*SIZE-1:0];
            end
        end
    endgenerate

    logic sign1, sign2, zero1, zero2;
    logic signed [EXPONENT+1:0] exponent1, exponent2;
    always_ff @(posedge clk) begin
        sign1 <= a[BITS-1] ^ b[BITS-1];
        zero1 <= zero;
        exponent1 <= $signed({2'b00, a[BITS-2:MANTISSA]}) + $signed({2'b00, b[BITS-2:MANTISSA]}) - BIAS;
        sign2 <= sign1;
        zero2 <= zero1;
        exponent2 <= exponent1;
    end

    // Cycle 3: the leading one is at the top or next to it.
    logic high;
    logic [BITS-1:0] number;
    assign high = whole2[2*SIZE-1];
    fp_round #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .EXTRA(SIZE)) round (
        .sign(sign2), .exponent(exponent2 + $signed({{(EXPONENT+1){1'b0}}, high})),
        .significand(high ? whole2 : {whole2[2*SIZE-2:0], 1'b0}), .zero(zero2), .number(number));
    always_ff @(posedge clk) product <= number;
endmodule
