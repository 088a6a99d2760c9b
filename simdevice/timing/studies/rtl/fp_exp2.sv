// Two to the power of a number, in two designs that do not round alike: a table with a quadratic (a line in narrow
// numbers), 4 cycles; or one polynomial, a cycle for each of its degrees and 2 more. The model defines both bit by bit.
module fp_exp2 #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int POLYNOMIAL = 0
) (
    input  logic clk,
    input  logic [EXPONENT+MANTISSA:0] x,
    output logic [EXPONENT+MANTISSA:0] power
);
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    localparam int WIDE = MANTISSA > 10;
    localparam int BIAS = (1 << (EXPONENT - 1)) - 1;
    localparam int FRACTION = WIDE ? 26 : 13;
    localparam int RESULT = WIDE ? 27 : 14;
    localparam int STAGES = (POLYNOMIAL == 0) ? 2 : WIDE ? 5 : 3;
    localparam int FIXED = EXPONENT + FRACTION;

    // The first cycle: a fixed-point argument.
    logic [FIXED-1:0] magnitude, magnitude_at_top;
    logic [EXPONENT-1:0] down;
    logic [FIXED:0] fixed, fixed1;
    logic far, far1, sign1;
    assign magnitude_at_top = {1'b1, x[MANTISSA-1:0], {(FIXED-MANTISSA-1){1'b0}}};
    assign down = EXPONENT[EXPONENT-1:0] - 1 + BIAS[EXPONENT-1:0] - x[BITS-2:MANTISSA];
    assign far = x[BITS-2:MANTISSA] >= EXPONENT[EXPONENT-1:0] + BIAS[EXPONENT-1:0];
    assign magnitude = x[BITS-2:MANTISSA] == 0 ? {FIXED{1'b0}} : magnitude_at_top >> down;
    assign fixed = x[BITS-1] ? -{1'b0, magnitude} : {1'b0, magnitude};
    always_ff @(posedge clk) begin
        fixed1 <= fixed;
        far1 <= far;
        sign1 <= x[BITS-1];
    end

    // Its whole part waits for the power of the rest.
    logic signed [EXPONENT:0] whole;
    logic far_late, sign_late;
    delay #(.WIDTH(EXPONENT + 3), .CYCLES(STAGES)) beside (
        .clk(clk), .in({fixed1[FIXED:FRACTION], far1, sign1}), .out({whole, far_late, sign_late}));

    logic [FRACTION-1:0] rest;
    logic [RESULT:0] value;
    assign rest = fixed1[FRACTION-1:0];
    generate
        if (POLYNOMIAL == 0) begin : table_design
            localparam int INDEX = WIDE ? 6 : 5;
            localparam int LOW = FRACTION - INDEX;
            localparam int SLOPE = WIDE ? 22 : 12;
            localparam int CURVATURE = WIDE ? 16 : 1;
            localparam int BEND = WIDE ? FRACTION + CURVATURE - SLOPE : 0;
            localparam int RISE = FRACTION + SLOPE - RESULT;
            logic [RESULT:0] start, start2;
            logic [SLOPE:0] slope, slope2;
            logic [CURVATURE-1:0] curvature;
            logic [LOW-1:0] low2;
            exp2_table #(.INDEX(INDEX), .POWER(RESULT + 1), .SLOPE(SLOPE + 1), .CURVATURE(CURVATURE)) entries (
                .index(rest[FRACTION-1:LOW]), .power(start), .slope(slope), .curvature(curvature));
            // The slope at this place, then the way along it.
            logic [LOW+SLOPE:0] bend, rise;
            assign bend = ({{(LOW+SLOPE+1-CURVATURE){1'b0}}, curvature} * {{(SLOPE+1){1'b0}}, rest[LOW-1:0]}) >> BEND;
            always_ff @(posedge clk) begin
                start2 <= start;
                slope2 <= slope + bend[SLOPE:0];
                low2 <= rest[LOW-1:0];
            end
            assign rise = ({{LOW{1'b0}}, slope2} * {{(SLOPE+1){1'b0}}, low2}) >> RISE;
            always_ff @(posedge clk) value <= start2 + rise[RESULT:0];
        end else begin : polynomial_design
            localparam int DEGREE = STAGES;
            // From the highest coefficient down to the constant.
            localparam logic [6*(RESULT+1)-1:0] COEFFICIENTS = WIDE
                ? {28'd240031, 28'd1234721, 28'd7470163, 28'd32240064, 28'd93032692, 28'd134217728}
                : {15'd0, 15'd0, 15'd1187, 15'd3827, 15'd11363, 15'd16384};
            logic [DEGREE*(RESULT+1)-1:0] held_sums;
            logic [DEGREE*FRACTION-1:0] held_rests;
            logic [(DEGREE+1)*(RESULT+1)-1:0] sums;
            logic [(DEGREE+1)*FRACTION-1:0] rests;
            assign sums = {held_sums, COEFFICIENTS[DEGREE*(RESULT+1)+:RESULT+1]};
            assign rests = {held_rests, rest};
            for (genvar i = 0; i < DEGREE; i = i + 1) begin : horner
                logic [RESULT+FRACTION:0] term;
                assign term = ({{FRACTION{1'b0}}, sums[i*(RESULT+1)+:RESULT+1]}
                    * {{(RESULT+1){1'b0}}, rests[i*FRACTION+:FRACTION]}) >> FRACTION;
                always_ff @(posedge clk) begin
                    held_sums[i*(RESULT+1)+:RESULT+1] <= COEFFICIENTS[(DEGREE-1-i)*(RESULT+1)+:RESULT+1] + term[RESULT:0];
                    held_rests[i*FRACTION+:FRACTION] <= rests[i*FRACTION+:FRACTION];
                end
            end
            assign value = sums[DEGREE*(RESULT+1)+:RESULT+1];
        end
    endgenerate

    // The last cycle: half a unit up, and the whole part becomes the exponent.
    localparam int EXTRA = RESULT - MANTISSA;
    logic [RESULT+1:0] rounded;
    logic carry;
    logic signed [EXPONENT+2:0] exponent;
    assign rounded = {1'b0, value} + (1 << (EXTRA - 1));
    assign carry = rounded[RESULT+1];
    assign exponent = $signed(whole) + $signed(BIAS[EXPONENT+2:0]) + $signed({{(EXPONENT+2){1'b0}}, carry});
    always_ff @(posedge clk) begin
        if (far_late ? sign_late : exponent <= 0)
            power <= 0;
        else if (far_late || exponent >= (1 << EXPONENT) - 1)
            power <= {1'b0, {(EXPONENT-1){1'b1}}, 1'b0, {MANTISSA{1'b1}}};
        else
            power <= {1'b0, exponent[EXPONENT-1:0], carry ? {MANTISSA{1'b0}} : rounded[EXTRA+:MANTISSA]};
    end
endmodule
