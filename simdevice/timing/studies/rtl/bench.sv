// Runs a rasterizer module on tiles, as bench.cpp does, in a simulator without C++: vvp bench +in=IN +out=OUT. The files are
// those of bench.cpp.
module bench #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int TWO_PATHS = 0,
    parameter int BOOTH = 0,
    parameter int POLYNOMIAL = 0,
    // The most words of a file.
    parameter int WORDS = 1 << 20
);
    localparam int BITS = 1 + EXPONENT + MANTISSA;

    logic clk, reset, tile_valid, tile_ready, request_valid, request_ready, data_valid, data_ready, write_valid, write_ready;
    logic in_flight, idle, offers;
    logic [2:0] cause;
    logic tile_mode;
    logic [31:0] tile_address, tile_count, request_address;
    logic [15:0] request_beats;
    logic [127:0] data, write_data;
    logic [31:0] words [0:WORDS-1];
    // What memory owes for requests, of which the oldest is at `first`: the word's place, the data that are left, and the
    // cycle from which they may come.
    logic [31:0] from [0:63], beats [0:63], due [0:63];
    logic [5:0] first, last;
    logic [31:0] tiles, latency, interval, seed, next, memory;
    logic [31:0] cycles, most, way, longest, free, most_owed;
    logic [31:0] causes [0:5];

    // A word of the file, whose bytes $fread takes as those of a big-endian one.
    function automatic [31:0] word(input [31:0] at);
        word = {words[at][7:0], words[at][15:8], words[at][23:16], words[at][31:24]};
    endfunction

    raster_module #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .TWO_PATHS(TWO_PATHS), .BOOTH(BOOTH),
                    .POLYNOMIAL(POLYNOMIAL)) module_of_it (
        .clk(clk), .reset(reset),
        .alpha_floor(BITS'(word(4))), .alpha_ceiling(BITS'(word(5))), .transmittance_floor(BITS'(word(6))),
        .depth_offset(BITS'(word(7))), .depth_scale(BITS'(word(8))), .blocks(1'(word(9))), .saturation(2'(word(10))),
        .tile_valid(tile_valid), .tile_ready(tile_ready), .tile_mode(tile_mode),
        .tile_address(tile_address), .tile_count(tile_count),
        .request_valid(request_valid), .request_ready(request_ready), .request_address(request_address),
        .request_beats(request_beats), .data_valid(data_valid), .data_ready(data_ready), .data(data),
        .write_valid(write_valid), .write_ready(write_ready), .write_data(write_data), .cause(cause), .in_flight(in_flight), .idle(idle));

    // A random bit; always 1 without a seed.
    task automatic may(output logic bit_of_it);
        if (seed != 0) seed = seed * 1664525 + 1013904223;
        bit_of_it = seed == 0 || seed[30];
    endtask

    // The inputs of a cycle, once the edge before it has passed.
    logic stall;
    task begin_cycle;
        if (next < tiles && !offers) may(offers);
        tile_valid = offers;
        tile_mode = 1'(word(11 + 3 * next));
        tile_address = word(12 + 3 * next);
        tile_count = word(13 + 3 * next);
        may(request_ready);
        may(write_ready);
        if (cycles < free) write_ready = 0;
        data_valid = 0;
        #1;
        may(stall);
        data_valid = first != last && due[first] <= cycles && cycles >= free && !(write_valid && write_ready) && stall;
        for (int k = 0; k < 4; k = k + 1) data[32*k+:32] = word(from[first] + k);
        #1;
    endtask

    string in, out;
    integer file, read;
    initial begin
        if (!$value$plusargs("in=%s", in) || !$value$plusargs("out=%s", out)) $fatal(1, "+in=IN +out=OUT");
        file = $fopen(in, "rb");
        if (file == 0) $fatal(1, "IN cannot be read");
        read = $fread(words, file);
        if (read < 44 || read >= 4 * WORDS) $fatal(1, "IN is too short or too long");
        $fclose(file);
        file = $fopen(out, "wb");
        if (file == 0) $fatal(1, "OUT cannot be written");
        tiles = word(0);
        latency = word(1);
        interval = word(2);
        seed = word(3);
        memory = 11 + 3 * tiles;
        // A pixel of a primitive waits for no more than the latency of its transmittance, and for memory.
        most = 10000 + 2000 * tiles;
        for (int at = 0; at < tiles; at = at + 1) most = most + (200 + latency) * word(13 + 3 * at);
        most = most * interval * (seed != 0 ? 8 : 1);
        {next, first, last, cycles, way, longest, free, most_owed, offers} = 0;
        for (int i = 0; i < 6; i = i + 1) causes[i] = 0;
        // The counts come first in the file; they are written once they are known.
        for (int i = 0; i < 9; i = i + 1) $fwrite(file, "%u", 32'd0);
        {clk, tile_valid, request_ready, data_valid, write_ready} = 0;
        reset = 1;
        for (int i = 0; i < 2; i = i + 1) begin
            #1 clk = 1;
            #1 clk = 0;
        end
        reset = 0;
        begin_cycle;
        while (!(next == tiles && idle && first == last)) begin
            way = cause == 1 ? 0 : way + 1;
            if (in_flight && way > longest) longest = way;
            causes[cause] = causes[cause] + 1;
            if (cycles > most) $fatal(1, "it does not end");
            if (tile_valid && tile_ready) begin
                next = next + 1;
                offers = 0;
            end
            if (data_valid && data_ready) begin
                from[first] = from[first] + 4;
                beats[first] = beats[first] - 1;
                if (beats[first] == 0) first = first + 1;
            end
            if (request_valid && request_ready) begin
                from[last] = memory + request_address / 4;
                beats[last] = {16'd0, request_beats};
                due[last] = cycles + 1 + latency;
                last = last + 1;
            end
            if ({26'd0, 6'(last - first)} > most_owed) most_owed = {26'd0, 6'(last - first)};
            if (write_valid && write_ready)
                for (int k = 0; k < 4; k = k + 1) $fwrite(file, "%u", write_data[32*k+:32]);
            if ((data_valid && data_ready) || (write_valid && write_ready)) free = cycles + interval;
            cycles = cycles + 1;
            #1 clk = 1;
            #1 clk = 0;
            begin_cycle;
        end
        read = $fseek(file, 0, 0);
        $fwrite(file, "%u", cycles);
        for (int i = 0; i < 6; i = i + 1) $fwrite(file, "%u", causes[i]);
        $fwrite(file, "%u", longest);
        $fwrite(file, "%u", most_owed);
        $fclose(file);
        $finish;
    end
endmodule
