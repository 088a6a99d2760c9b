// Cycles from operands to results of the units, and of what a PE makes of them. A module that includes this has the
// parameters MANTISSA and POLYNOMIAL.
localparam int ADD = 3;
localparam int MUL = 3;
// Two bits of the quotient a cycle, between unpacking and rounding.
localparam int DIV = (MANTISSA + 3) / 2 + 2;
localparam int EXP = (POLYNOMIAL == 0) ? 4 : (MANTISSA > 10) ? 7 : 5;

// A triangle: planes, reciprocal, weights, the third weight. All results leave together.
localparam int PLANES = MUL + 2 * ADD;
localparam int TRIANGLE = PLANES + DIV + MUL + 2 * ADD;

// A Gaussian: the exponent, alpha; then the pixel's transmittance is read, later written, and at last its colour is.
localparam int POWER = 4 * ADD + 2 * MUL;
localparam int ALPHA = POWER + EXP;
localparam int READ = ALPHA + ADD;
localparam int WRITE = READ + MUL + ADD;
localparam int GAUSSIAN = READ + 2 * MUL + ADD;
// Two Gaussians of a pixel begin at least so many cycles apart.
localparam int CARRIED = MUL + ADD + 1;
