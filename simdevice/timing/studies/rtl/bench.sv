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

    logic clk, reset, tile_valid, tile_ready, request_valid, request_cold, data_valid, write_valid, in_flight, idle;
    logic [2:0] cause;
    logic tile_mode;
    logic [31:0] tile_address, tile_count, request_address;
    logic [15:0] request_beats;
    logic [127:0] data, write_data;
    logic [31:0] words [0:WORDS-1];
    // The words' places: of a tile's numbers, and of the data that answer a request.
    logic [31:0] tiles, latency, next, memory, from, beats, waits;
    logic [31:0] cycles, most, way, longest;
    logic [31:0] causes [0:5];

    // A word of the file, whose bytes $fread takes as those of a big-endian one.
    function automatic [31:0] word(input [31:0] at);
        word = {words[at][7:0], words[at][15:8], words[at][23:16], words[at][31:24]};
    endfunction

    raster_module #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .TWO_PATHS(TWO_PATHS), .BOOTH(BOOTH),
                    .POLYNOMIAL(POLYNOMIAL)) module_of_it (
        .clk(clk), .reset(reset),
        .alpha_floor(BITS'(word(2))), .alpha_ceiling(BITS'(word(3))), .transmittance_floor(BITS'(word(4))),
        .depth_offset(BITS'(word(5))), .depth_scale(BITS'(word(6))), .blocks(1'(word(7))), .saturation(2'(word(8))),
        .tile_valid(tile_valid), .tile_ready(tile_ready), .tile_mode(tile_mode),
        .tile_address(tile_address), .tile_count(tile_count),
        .request_valid(request_valid), .request_cold(request_cold), .request_address(request_address),
        .request_beats(request_beats), .data_valid(data_valid), .data(data),
        .write_valid(write_valid), .write_data(write_data), .cause(cause), .in_flight(in_flight), .idle(idle));

    // The inputs of a cycle, once the edge before it has passed.
    task begin_cycle;
        tile_valid = next < tiles;
        tile_mode = 1'(word(9 + 3 * next));
        tile_address = word(10 + 3 * next);
        tile_count = word(11 + 3 * next);
        data_valid = beats > 0 && waits == 0;
        for (int k = 0; k < 4; k = k + 1) data[32*k+:32] = word(from + k);
        #1;
    endtask

    string in, out;
    integer file, read;
    initial begin
        if (!$value$plusargs("in=%s", in) || !$value$plusargs("out=%s", out)) $fatal(1, "+in=IN +out=OUT");
        file = $fopen(in, "rb");
        if (file == 0) $fatal(1, "IN cannot be read");
        read = $fread(words, file);
        if (read < 36 || read >= 4 * WORDS) $fatal(1, "IN is too short or too long");
        $fclose(file);
        file = $fopen(out, "wb");
        if (file == 0) $fatal(1, "OUT cannot be written");
        tiles = word(0);
        latency = word(1);
        memory = 9 + 3 * tiles;
        // A pixel of a primitive waits for no more than the latency of its transmittance.
        most = 10000 + 2000 * tiles;
        for (int at = 0; at < tiles; at = at + 1) most = most + 200 * word(11 + 3 * at);
        {next, from, beats, waits, cycles, way, longest} = 0;
        for (int i = 0; i < 6; i = i + 1) causes[i] = 0;
        // The counts come first in the file; they are written once they are known.
        for (int i = 0; i < 8; i = i + 1) $fwrite(file, "%u", 32'd0);
        {clk, tile_valid, data_valid} = 0;
        reset = 1;
        for (int i = 0; i < 2; i = i + 1) begin
            #1 clk = 1;
            #1 clk = 0;
        end
        reset = 0;
        begin_cycle;
        while (!(next == tiles && idle && beats == 0)) begin
            way = cause == 1 ? 0 : way + 1;
            if (in_flight && way > longest) longest = way;
            causes[cause] = causes[cause] + 1;
            cycles = cycles + 1;
            if (cycles > most) $fatal(1, "it does not end");
            if (tile_valid && tile_ready) next = next + 1;
            if (data_valid) begin
                from = from + 4;
                beats = beats - 1;
            end else if (waits > 0)
                waits = waits - 1;
            if (request_valid) begin
                from = memory + request_address / 4;
                beats = {16'd0, request_beats};
                waits = request_cold ? latency : 0;
            end
            if (write_valid)
                for (int k = 0; k < 4; k = k + 1) $fwrite(file, "%u", write_data[32*k+:32]);
            #1 clk = 1;
            #1 clk = 0;
            begin_cycle;
        end
        read = $fseek(file, 0, 0);
        $fwrite(file, "%u", cycles);
        for (int i = 0; i < 6; i = i + 1) $fwrite(file, "%u", causes[i]);
        $fwrite(file, "%u", longest);
        $fclose(file);
        $finish;
    end
endmodule
