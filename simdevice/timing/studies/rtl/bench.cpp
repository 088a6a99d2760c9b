// Runs a rasterizer module on tiles: bench IN OUT. Files are little-endian words of 32 bits.
// IN: tiles, cycles until a request that could not be foreseen is answered, alpha's floor and ceiling, transmittance's
// floor, depth's offset and scale, whether groups are blocks, saturation; of each tile its mode, the list's address in bytes and its primitives; then memory.
// OUT: cycles, cycles by cause (six), the longest way of a pixel through a PE; then what was written.
#include "Vraster_module.h"
#include "verilated.h"
#include <cstdint>
#include <cstdio>
#include <vector>

static std::vector<uint32_t> read_words(const char *path) {
    std::vector<uint32_t> words;
    FILE *file = std::fopen(path, "rb");
    if (!file) return words;
    uint32_t word;
    while (std::fread(&word, sizeof word, 1, file) == 1) words.push_back(word);
    std::fclose(file);
    return words;
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    const std::vector<uint32_t> in = read_words(arguments[1]);
    if (in.size() < 9) return 2;
    const uint32_t tiles = in[0], latency = in[1];
    const uint32_t *tile = in.data() + 9, *memory = tile + 3 * tiles;
    VerilatedContext context;
    Vraster_module module(&context);
    module.alpha_floor = in[2];
    module.alpha_ceiling = in[3];
    module.transmittance_floor = in[4];
    module.depth_offset = in[5];
    module.depth_scale = in[6];
    module.blocks = in[7];
    module.saturation = in[8];
    module.reset = 1;
    module.tile_valid = 0;
    module.data_valid = 0;
    auto clock = [&] {
        module.clk = 1;
        module.eval();
        module.clk = 0;
        module.eval();
    };
    module.clk = 0;
    clock();
    clock();
    module.reset = 0;

    std::vector<uint32_t> written;
    uint64_t cycles = 0, causes[6] = {}, way = 0, longest = 0;
    uint32_t next = 0, beats = 0, wait = 0;
    const uint32_t *from = memory;
    for (;;) {
        module.tile_valid = next < tiles;
        if (next < tiles) {
            module.tile_mode = tile[3 * next];
            module.tile_address = tile[3 * next + 1];
            module.tile_count = tile[3 * next + 2];
        }
        module.data_valid = beats > 0 && wait == 0;
        if (module.data_valid)
            for (int k = 0; k < 4; ++k) module.data[k] = from[k];
        module.eval();
        if (next == tiles && module.idle && beats == 0) break;
        // What was issued until a cycle is a pixel's way once nothing else is on its own.
        way = module.cause == 1 ? 0 : way + 1;
        if (module.in_flight && way > longest) longest = way;
        ++causes[module.cause];
        ++cycles;
        if (module.tile_valid && module.tile_ready) ++next;
        if (module.data_valid) {
            from += 4;
            --beats;
        } else if (wait > 0)
            --wait;
        if (module.request_valid) {
            from = memory + module.request_address / 4;
            beats = module.request_beats;
            wait = module.request_cold ? latency : 0;
        }
        if (module.write_valid)
            for (int k = 0; k < 4; ++k) written.push_back(module.write_data[k]);
        clock();
    }
    module.final();

    FILE *file = std::fopen(arguments[2], "wb");
    if (!file) return 2;
    auto put = [&](uint64_t value) {
        const uint32_t word = static_cast<uint32_t>(value);
        std::fwrite(&word, sizeof word, 1, file);
    };
    put(cycles);
    for (uint64_t cause : causes) put(cause);
    put(longest);
    std::fwrite(written.data(), sizeof(uint32_t), written.size(), file);
    return std::fclose(file) == 0 ? 0 : 2;
}
