// Feeds pairs of numbers to every unit: units IN OUT. Each pair is held for longer than any unit takes.
// IN: pairs of words. OUT: for each pair sum, product, quotient, power and powers of the other designs: seven words.
#include "Vunits.h"
#include "verilated.h"
#include <cstdint>
#include <cstdio>

int main(int count, char **arguments) {
    if (count != 3) return 2;
    FILE *in = std::fopen(arguments[1], "rb"), *out = std::fopen(arguments[2], "wb");
    if (!in || !out) return 2;
    VerilatedContext context;
    Vunits units(&context);
    uint32_t pair[2];
    while (std::fread(pair, sizeof pair, 1, in) == 1) {
        units.a = pair[0];
        units.b = pair[1];
        for (int cycle = 0; cycle < 24; ++cycle) {
            units.clk = 0;
            units.eval();
            units.clk = 1;
            units.eval();
        }
        const uint32_t results[7] = {units.sum, units.sum_two_paths, units.product, units.product_booth,
                                     units.quotient, units.power, units.power_polynomial};
        std::fwrite(results, sizeof results, 1, out);
    }
    units.final();
    std::fclose(in);
    return std::fclose(out) == 0 ? 0 : 2;
}
