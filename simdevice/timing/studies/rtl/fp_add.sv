// The sum of two numbers, 3 cycles later. Two designs of the same function: one path that aligns, adds, normalises and
// rounds; or two paths, of which the near one (a difference of neighbours, with a long shift and no rounding) and the far
// one (with rounding and no long shift) work side by side.
module fp_add #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int TWO_PATHS = 0
) (
    input  logic clk,
    input  logic [EXPONENT+MANTISSA:0] a,
    input  logic [EXPONENT+MANTISSA:0] b,
    output logic [EXPONENT+MANTISSA:0] sum
);
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    // A significand with guard, round and sticky bits.
    localparam int WIDTH = MANTISSA + 4;
    localparam int SHIFT = $clog2(WIDTH + 1);

    // Cycle 1: the larger magnitude first, the smaller one aligned to it.
    logic [BITS-1:0] greater, lesser;
    logic greater_zero, lesser_zero;
    logic [EXPONENT-1:0] distance;
    logic [WIDTH-1:0] whole, aligned;
    logic lost;
    always_comb begin
        if (a[BITS-2:0] >= b[BITS-2:0]) begin
            greater = a;
            lesser = b;
        end else begin
            greater = b;
            lesser = a;
        end
    end
    assign greater_zero = greater[BITS-2:MANTISSA] == 0;
    assign lesser_zero = lesser[BITS-2:MANTISSA] == 0;
    assign distance = greater[BITS-2:MANTISSA] - lesser[BITS-2:MANTISSA];
    assign whole = lesser_zero ? {WIDTH{1'b0}} : {1'b1, lesser[MANTISSA-1:0], 3'b000};
    always_comb begin
        aligned = whole;
        lost = 1'b0;
        for (int i = 0; i < SHIFT; i = i + 1)
            if (distance[i]) begin
                for (int j = 0; j < (1 << i); j = j + 1)
                    lost = lost | aligned[j];
                aligned = aligned >> (1 << i);
            end
        if (|(distance >> SHIFT)) begin
            aligned = 0;
            lost = !lesser_zero;
        end
    end

    logic [WIDTH-1:0] greater1, aligned1;
    logic sign1, subtract1;
    logic [EXPONENT-1:0] exponent1;
    always_ff @(posedge clk) begin
        greater1 <= greater_zero ? {WIDTH{1'b0}} : {1'b1, greater[MANTISSA-1:0], 3'b000};
        aligned1 <= {aligned[WIDTH-1:1], aligned[0] | lost};
        sign1 <= greater_zero ? a[BITS-1] & b[BITS-1] : greater[BITS-1];
        subtract1 <= a[BITS-1] ^ b[BITS-1];
        exponent1 <= greater[BITS-2:MANTISSA];
    end

    // Cycle 2: the sum.
    logic [WIDTH:0] total, total2;
    logic sign2, vanished2;
    logic [EXPONENT-1:0] exponent2;
    assign total = subtract1 ? {1'b0, greater1} - {1'b0, aligned1} : {1'b0, greater1} + {1'b0, aligned1};
    always_ff @(posedge clk) begin
        total2 <= total;
        exponent2 <= exponent1;
        sign2 <= sign1;
        // What cancels is +0; two zeros keep what sign they share.
        vanished2 <= subtract1;
    end

    generate
        if (TWO_PATHS == 0) begin : one_path
            // Cycle 2: leading zeros. Cycle 3: normalise and round.
            logic [SHIFT-1:0] zeros, zeros2;
            always_comb begin
                zeros = 0;
                for (int i = 0; i < WIDTH; i = i + 1)
                    if (total[i]) zeros = WIDTH[SHIFT-1:0] - 1 - i[SHIFT-1:0];
            end
            always_ff @(posedge clk) zeros2 <= zeros;

            logic [WIDTH-1:0] normal;
            logic signed [EXPONENT+1:0] exponent;
            logic zero;
            always_comb begin
                if (total2[WIDTH]) begin
                    normal = {total2[WIDTH:2], total2[1] | total2[0]};
                    exponent = $signed({2'b00, exponent2}) + 1;
                end else begin
                    normal = total2[WIDTH-1:0] << zeros2;
                    exponent = $signed({2'b00, exponent2}) - $signed({{(EXPONENT+2-SHIFT){1'b0}}, zeros2});
                end
            end
            assign zero = total2 == 0;
            logic [BITS-1:0] number;
            fp_round #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .EXTRA(3)) round (
                .sign(zero && vanished2 ? 1'b0 : sign2), .exponent(exponent), .significand(normal), .zero(zero),
                .number(number));
            always_ff @(posedge clk) sum <= number;
        end else begin : two_paths
            // The near path. Cycle 1: a difference in exponent of 0 or 1.
            localparam int NEAR = MANTISSA + 2;
            localparam int COUNT = $clog2(NEAR + 1);
            logic [NEAR-1:0] near_greater1, near_lesser1, difference, difference2;
            logic close1, near2;
            logic [COUNT-1:0] zeros, zeros2;
            always_ff @(posedge clk) begin
                close1 <= distance <= 1;
                near_greater1 <= greater_zero ? {NEAR{1'b0}} : {1'b1, greater[MANTISSA-1:0], 1'b0};
                near_lesser1 <= lesser_zero ? {NEAR{1'b0}} :
                               distance[0] ? {1'b0, 1'b1, lesser[MANTISSA-1:0]} : {1'b1, lesser[MANTISSA-1:0], 1'b0};
            end
            // Cycle 2: the difference, which is exact, and its leading zeros.
            assign difference = near_greater1 - near_lesser1;
            always_comb begin
                zeros = 0;
                for (int i = 0; i < NEAR; i = i + 1)
                    if (difference[i]) zeros = NEAR[COUNT-1:0] - 1 - i[COUNT-1:0];
            end
            always_ff @(posedge clk) begin
                difference2 <= difference;
                zeros2 <= zeros;
                near2 <= close1 && subtract1 && !difference[NEAR-1];
            end
            // Cycle 3: a shift.
            logic [NEAR-1:0] shifted;
            logic signed [EXPONENT+1:0] near_exponent;
            logic [BITS-1:0] near_number;
            assign shifted = difference2 << zeros2;
            assign near_exponent = $signed({2'b00, exponent2}) - $signed({{(EXPONENT+2-COUNT){1'b0}}, zeros2});
            always_comb begin
                near_number = {sign2, near_exponent[EXPONENT-1:0], shifted[NEAR-2:1]};
                if (difference2 == 0)
                    near_number = 0;
                else if (near_exponent <= 0)
                    near_number = {sign2, {(BITS-1){1'b0}}};
                else if (near_exponent >= (1 << EXPONENT) - 1)
                    near_number = {sign2, {(EXPONENT-1){1'b1}}, 1'b0, {MANTISSA{1'b1}}};
            end

            // The far path. Cycle 3: one place to the right or to the left, then rounding.
            logic [WIDTH-1:0] normal;
            logic signed [EXPONENT+1:0] exponent;
            logic [BITS-1:0] far_number;
            always_comb begin
                if (total2[WIDTH]) begin
                    normal = {total2[WIDTH:2], total2[1] | total2[0]};
                    exponent = $signed({2'b00, exponent2}) + 1;
                end else if (total2[WIDTH-1]) begin
                    normal = total2[WIDTH-1:0];
                    exponent = $signed({2'b00, exponent2});
                end else begin
                    normal = {total2[WIDTH-2:0], 1'b0};
                    exponent = $signed({2'b00, exponent2}) - 1;
                end
            end
            fp_round #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .EXTRA(3)) round (
                .sign(sign2), .exponent(exponent), .significand(normal), .zero(total2 == 0), .number(far_number));
            always_ff @(posedge clk) sum <= near2 ? near_number : far_number;
        end
    endgenerate
endmodule
