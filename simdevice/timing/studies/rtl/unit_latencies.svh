// Cycles from operands to results of the units. A module that includes this has the parameter MANTISSA.
localparam int ADD = 3;
localparam int MUL = 3;
// Two bits of the quotient a cycle, between unpacking and rounding.
localparam int DIV = (MANTISSA + 3) / 2 + 2;
