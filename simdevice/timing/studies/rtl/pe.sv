// A processing element. A pixel may begin in each cycle, in the mode of all pixels in the pipeline. It has 9 adders,
// 9 multipliers and a divider for triangles; GAUSSIANS adds 2 adders, a multiplier, an exponential and the multiplexers
// of their operands. Numbers and a pixel's values arrive when they are used: see latencies.svh.
//
//            numbers of a triangle            numbers of a Gaussian
//   0..2     plane of u/w: x, y, constant     exponent of dx^2, of dx dy, mean x
//   3..5     plane of v/w                     exponent of dy^2, mean y, red
//   6..8     plane of 1/w                     green, blue, logarithm of the opacity to base 2
module pe #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int GAUSSIANS = 1,
    parameter int TWO_PATHS = 0,
    parameter int BOOTH = 0,
    parameter int POLYNOMIAL = 0
) (
    input  logic clk,
    // 1 for Gaussians, 0 for triangles.
    input  logic mode,
    // The pixel's centre, from its tile's corner.
    input  logic [EXPONENT+MANTISSA:0] x,
    input  logic [EXPONENT+MANTISSA:0] y,
    input  logic [9*(1+EXPONENT+MANTISSA)-1:0] numbers,
    // Parameters of the draw.
    input  logic [EXPONENT+MANTISSA:0] depth_offset,
    input  logic [EXPONENT+MANTISSA:0] depth_scale,
    input  logic [EXPONENT+MANTISSA:0] alpha_floor,
    input  logic [EXPONENT+MANTISSA:0] alpha_ceiling,
    input  logic [EXPONENT+MANTISSA:0] transmittance_floor,
    // The pixel's values: at READ, and an addition before GAUSSIAN.
    input  logic [EXPONENT+MANTISSA:0] transmittance,
    input  logic [3*(1+EXPONENT+MANTISSA)-1:0] color,
    // At TRIANGLE: u, v and depth, from the lowest bits up.
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] fragment,
    output logic covered,
    // At WRITE: whether alpha reaches its floor, whether the pixel stays unfinished, and its new transmittance.
    output logic reaches,
    output logic open,
    output logic [EXPONENT+MANTISSA:0] next_transmittance,
    // At GAUSSIAN: the new colour.
    output logic [3*(1+EXPONENT+MANTISSA)-1:0] next_color
);
    // Verilator compiles this module once for all of its instances.
    /* verilator hier_block */
    `include "latencies.svh"
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    localparam logic [BITS-1:0] ONE = {2'b00, {(EXPONENT-1){1'b1}}, {MANTISSA{1'b0}}};
    localparam logic [BITS-1:0] SIGN = {1'b1, {(BITS-1){1'b0}}};

    logic [BITS-1:0] n0, n1, n2, n3, n4, n5, n6, n7, n8;
    assign {n8, n7, n6, n5, n4, n3, n2, n1, n0} = numbers;
    logic g;
    assign g = GAUSSIANS != 0 && mode;

    // The units: operands of the triangles' 9 and 9, and their results.
    logic [BITS-1:0] ma0, ma1, ma2, ma3, ma4, ma5, ma6, ma7, ma8, mb0, mb1, mb2, mb3, mb4, mb5, mb6, mb7, mb8;
    logic [BITS-1:0] aa0, aa1, aa2, aa3, aa4, aa5, aa6, aa7, aa8, ab0, ab1, ab2, ab3, ab4, ab5, ab6, ab7, ab8;
    logic [9*BITS-1:0] products, sums;
    logic [BITS-1:0] m0, m1, m2, m3, m4, m5, m6, m7, m8, a0, a1, a2, a3, a4, a5, a6, a7, a8;
    logic [9*BITS-1:0] left_factors, right_factors, left_terms, right_terms;
    assign left_factors = {ma8, ma7, ma6, ma5, ma4, ma3, ma2, ma1, ma0};
    assign right_factors = {mb8, mb7, mb6, mb5, mb4, mb3, mb2, mb1, mb0};
    assign left_terms = {aa8, aa7, aa6, aa5, aa4, aa3, aa2, aa1, aa0};
    assign right_terms = {ab8, ab7, ab6, ab5, ab4, ab3, ab2, ab1, ab0};
    generate
        for (genvar i = 0; i < 9; i = i + 1) begin : shared
            fp_mul #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .BOOTH(BOOTH)) multiplier (
                .clk(clk), .a(left_factors[i*BITS+:BITS]), .b(right_factors[i*BITS+:BITS]),
                .product(products[i*BITS+:BITS]));
            fp_add #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .TWO_PATHS(TWO_PATHS)) adder (
                .clk(clk), .a(left_terms[i*BITS+:BITS]), .b(right_terms[i*BITS+:BITS]),
                .sum(sums[i*BITS+:BITS]));
        end
    endgenerate
    assign {m8, m7, m6, m5, m4, m3, m2, m1, m0} = products;
    assign {a8, a7, a6, a5, a4, a3, a2, a1, a0} = sums;

    // Triangles: the reciprocal of 1/w, and the values delayed for it and for the third weight.
    logic [BITS-1:0] w, u_over_w, v_over_w, v_weight, u, v, depth;
    fp_div #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA)) divider (.clk(clk), .a(ONE), .b(a5), .quotient(w));
    delay #(.WIDTH(2 * BITS), .CYCLES(DIV)) for_w (.clk(clk), .in({a3, a1}), .out({v_over_w, u_over_w}));
    delay #(.WIDTH(BITS), .CYCLES(ADD)) for_rest (.clk(clk), .in(m7), .out(v_weight));
    delay #(.WIDTH(BITS), .CYCLES(ADD)) v_late (.clk(clk), .in(v_weight), .out(v));
    delay #(.WIDTH(BITS), .CYCLES(2 * ADD)) u_late (.clk(clk), .in(m6), .out(u));
    delay #(.WIDTH(BITS), .CYCLES(DIV + ADD)) depth_late (.clk(clk), .in(a8), .out(depth));
    assign fragment = {depth, v, u};
    // The signs of the three weights tell whether the pixel is covered.
    assign covered = !u[BITS-1] && !v[BITS-1] && !a7[BITS-1];

    // Gaussians: their own units, and the values delayed for others.
    logic [BITS-1:0] dx, dy, dx_late, dy_late, second, alpha, alpha_late, green;
    generate
        if (GAUSSIANS != 0) begin : gaussians
            logic [BITS-1:0] power, lit;
            fp_add #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .TWO_PATHS(TWO_PATHS)) across (
                .clk(clk), .a(x), .b(n2 ^ SIGN), .sum(dx));
            fp_add #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .TWO_PATHS(TWO_PATHS)) down (
                .clk(clk), .a(y), .b(n4 ^ SIGN), .sum(dy));
            fp_exp2 #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .POLYNOMIAL(POLYNOMIAL)) exponential (
                .clk(clk), .x(a5), .power(power));
            fp_mul #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .BOOTH(BOOTH)) greener (
                .clk(clk), .a(m6), .b(n6), .product(lit));
            delay #(.WIDTH(BITS), .CYCLES(MUL + ADD)) dx_waits (.clk(clk), .in(dx), .out(dx_late));
            delay #(.WIDTH(BITS), .CYCLES(MUL)) dy_waits (.clk(clk), .in(dy), .out(dy_late));
            delay #(.WIDTH(BITS), .CYCLES(ADD)) second_waits (.clk(clk), .in(m4), .out(second));
            // Both are positive, so they compare as integers.
            assign alpha = power > alpha_ceiling ? alpha_ceiling : power;
            delay #(.WIDTH(BITS), .CYCLES(ADD)) alpha_waits (.clk(clk), .in(alpha), .out(alpha_late));
            delay #(.WIDTH(BITS), .CYCLES(ADD)) rest_waits (.clk(clk), .in(m7), .out(next_transmittance));
            delay #(.WIDTH(1), .CYCLES(MUL + ADD)) reach_waits (.clk(clk), .in(!a1[BITS-1]), .out(reaches));
            assign green = lit;
        end else begin : none
            assign {dx, dy, dx_late, dy_late, second, alpha, alpha_late, green, next_transmittance} = 0;
            assign reaches = 0;
        end
    endgenerate
    assign open = !a6[BITS-1];
    assign next_color = {a7, a2, a8};

    // The computation of each unit in each mode.
    //                     Gaussian                       triangle
    assign ma0 = n0;
    assign mb0 = g ? dx : x;
    assign ma1 = n1;
    assign mb1 = g ? dy : y;
    assign ma2 = n3;
    assign mb2 = g ? dy : x;
    assign ma3 = g ? a0 : n4;
    assign mb3 = g ? dx_late : y;
    assign ma4 = g ? m2 : n6;
    assign mb4 = g ? dy_late : x;
    assign ma5 = n7;
    assign mb5 = g ? m6 : y;
    assign ma6 = g ? alpha_late : u_over_w;
    assign mb6 = g ? transmittance : w;
    assign ma7 = g ? a3 : v_over_w;
    assign mb7 = g ? transmittance : w;
    assign ma8 = g ? n5 : depth_scale;
    assign mb8 = g ? m6 : a5;

    assign aa0 = m0;
    assign ab0 = m1;
    assign aa1 = g ? alpha : a0;
    assign ab1 = g ? alpha_floor ^ SIGN : n2;
    assign aa2 = g ? color[BITS+:BITS] : m2;
    assign ab2 = g ? green : m3;
    assign aa3 = g ? ONE : a2;
    assign ab3 = g ? alpha ^ SIGN : n5;
    assign aa4 = g ? m3 : m4;
    assign ab4 = g ? second : m5;
    assign aa5 = a4;
    assign ab5 = n8;
    assign aa6 = g ? m7 : ONE;
    assign ab6 = g ? transmittance_floor ^ SIGN : m6 ^ SIGN;
    assign aa7 = g ? color[2*BITS+:BITS] : a6;
    assign ab7 = g ? m5 : v_weight ^ SIGN;
    assign aa8 = g ? color[BITS-1:0] : depth_offset;
    assign ab8 = m8;
endmodule
