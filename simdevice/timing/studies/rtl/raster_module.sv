// A rasterizer module: tile buffers A and B, 16 PEs that take a 16x16 tile in groups of 16 pixels, two tiles' pixels, and
// the controller. It is given tiles one after the other, each a list in memory; it fetches the lists through its port,
// which moves 16 bytes in a cycle, in or out, and writes three numbers for each pixel.
//
// A group is a row of the tile or a block of 4x4 pixels. Each primitive names the groups that it is evaluated in. A list
// starts at a multiple of 16 bytes, and BATCH is a multiple of 8.
module raster_module #(
    parameter int EXPONENT = 8,
    parameter int MANTISSA = 23,
    parameter int BATCH = 32,
    parameter int TWO_PATHS = 0,
    parameter int BOOTH = 0,
    parameter int POLYNOMIAL = 0
) (
    input  logic clk,
    input  logic reset,
    // Of the draw.
    input  logic [EXPONENT+MANTISSA:0] depth_offset,
    input  logic [EXPONENT+MANTISSA:0] depth_scale,
    input  logic [EXPONENT+MANTISSA:0] alpha_floor,
    input  logic [EXPONENT+MANTISSA:0] alpha_ceiling,
    input  logic [EXPONENT+MANTISSA:0] transmittance_floor,
    // Whether groups are blocks. Saturation: 0, a list is taken to its end; 1, it ends once all pixels are finished; 2,
    // groups of finished pixels are left out, too.
    input  logic blocks,
    input  logic [1:0] saturation,
    // The next tile: its mode (1 for Gaussians), where its list is and how many primitives that has, at least 1.
    input  logic tile_valid,
    output logic tile_ready,
    input  logic tile_mode,
    input  logic [31:0] tile_address,
    input  logic [31:0] tile_count,
    // The port: a request, and whether it could not be foreseen; what comes for it, in order; what is written.
    output logic request_valid,
    output logic request_cold,
    output logic [31:0] request_address,
    output logic [15:0] request_beats,
    input  logic data_valid,
    input  logic [127:0] data,
    output logic write_valid,
    output logic [127:0] write_data,
    // What the PEs do: 0 nothing is left, 1 a pixel each, 2 wait for a pixel's transmittance, 3 wait for memory, 4 wait for
    // the controller, 5 change modes. And whether pixels are on their way through them, and nothing is left at all.
    output logic [2:0] cause,
    output logic in_flight,
    output logic idle
);
    `include "latencies.svh"
    localparam int BITS = 1 + EXPONENT + MANTISSA;
    localparam int PES = 16;
    localparam int INDEX = $clog2(2 * BATCH);
    localparam int BYTES = 4 + 9 * BITS / 8;
    localparam int LONGEST = (GAUSSIAN > TRIANGLE) ? GAUSSIAN : TRIANGLE;
    localparam logic [LONGEST:0] AS_GAUSSIAN = {(LONGEST+1){1'b1}} >> (LONGEST - GAUSSIAN);
    localparam logic [LONGEST:0] AS_TRIANGLE = {(LONGEST+1){1'b1}} >> (LONGEST - TRIANGLE);

    // ---- Fetching: a list, a batch of it at a time, into whichever half is free.
    logic listed, list_mode, list_first, list_tag, fetching, filling, cold;
    logic [31:0] list_address, list_left;
    logic [15:0] beats_left;
    logic [1:0] ready, batch_mode, batch_first, batch_last, batch_tag;
    logic [INDEX-1:0] batch_count [0:1];
    logic leaving, leave_due;
    logic [31:0] size;
    logic ends_early, drop_list, drop_half, done_half;

    assign size = list_left < BATCH ? list_left : BATCH;
    assign tile_ready = !listed;
    assign request_valid = listed && !fetching && !ready[filling] && !leaving && !leave_due && !drop_list;
    assign request_cold = cold;
    assign request_address = list_address;
    assign request_beats = 16'((size * BYTES + 15) >> 4);

    always_ff @(posedge clk) begin
        if (tile_ready && tile_valid) begin
            listed <= 1'b1;
            list_mode <= tile_mode;
            list_address <= tile_address;
            list_left <= tile_count;
            list_first <= 1'b1;
            list_tag <= !list_tag;
        end
        if (request_valid) begin
            fetching <= 1'b1;
            cold <= 1'b0;
            beats_left <= request_beats;
            batch_mode[filling] <= list_mode;
            batch_first[filling] <= list_first;
            batch_last[filling] <= list_left <= BATCH;
            batch_tag[filling] <= list_tag;
            batch_count[filling] <= INDEX'(size);
            list_first <= 1'b0;
            list_address <= list_address + BATCH * BYTES;
            list_left <= list_left - size;
            if (list_left <= BATCH) listed <= 1'b0;
        end
        if (fetching && data_valid) begin
            beats_left <= beats_left - 1;
            if (beats_left == 1) begin
                fetching <= 1'b0;
                ready[filling] <= 1'b1;
                filling <= !filling;
            end
        end
        if (drop_half || done_half) ready[using] <= 1'b0;
        if (drop_list) listed <= 1'b0;
        // The next request could not be foreseen.
        if (ends_early) cold <= 1'b1;
        if (reset) begin
            listed <= 1'b0;
            list_tag <= 1'b0;
            fetching <= 1'b0;
            filling <= 1'b0;
            ready <= 2'b00;
            cold <= 1'b1;
        end
    end

    // ---- Evaluating: a batch, one primitive after the other, each in its groups.
    logic active, using, mode, ended, ended_tag, tile;
    logic [INDEX-2:0] current;
    logic [15:0] todo, open_groups, pending, next_groups;
    logic [3:0] group;
    logic [9*BITS-1:0] numbers;
    logic is_last_primitive, is_last_group, waits_for_pixel, tile_finished, starts, stale, issue, looks;
    // A tile's pixels: 0 free, 1 being drawn, 2 complete once what is on its way has left, 3 leaving.
    logic [1:0] pixels [0:1];
    logic [1:0] modes;
    logic [15:0] finished_groups;
    logic [LONGEST:0] valid;
    logic [5*(LONGEST+1)-1:0] places;

    primitive_buffer #(.BITS(BITS), .BATCH(BATCH), .INDEX(INDEX)) primitives (
        .clk(clk), .begin_batch(request_valid), .fill(fetching && data_valid), .half(filling), .data(data),
        .at({using, current}), .numbers(numbers),
        .next_at(active ? {using, current + 1'b1} : {using, {(INDEX-1){1'b0}}}), .next_groups(next_groups));

    assign tile_finished = saturation != 0 && mode && (&finished_groups);
    assign open_groups = saturation == 2 && mode ? ~finished_groups : 16'hffff;
    assign pending = todo & open_groups;
    always_comb begin
        group = 0;
        for (int i = 15; i >= 0; i = i - 1)
            if (pending[i]) group = i[3:0];
    end
    // Whoever began less than CARRIED cycles ago has not left its transmittance yet.
    always_comb begin
        waits_for_pixel = 1'b0;
        for (int i = 0; i < CARRIED - 1; i = i + 1)
            if (mode && valid[i] && places[i*5+:5] == {tile, group}) waits_for_pixel = 1'b1;
    end
    assign is_last_primitive = {1'b0, current} + 1'b1 == batch_count[using];
    assign is_last_group = (pending & (pending - 1)) == 0;
    assign stale = ended && batch_tag[using] == ended_tag;
    assign in_flight = mode ? |valid[GAUSSIAN:0] : |valid[TRIANGLE:0];
    assign starts = !active && ready[using] && !stale && batch_mode[using] == mode
                    && !(batch_first[using] && pixels[!tile] != 0);
    assign issue = active && !tile_finished && pending != 0 && !waits_for_pixel;
    assign looks = active && !tile_finished && pending == 0;
    assign drop_half = (!active && ready[using] && stale) || (active && tile_finished);
    assign done_half = (looks || (issue && is_last_group)) && is_last_primitive;
    assign ends_early = active && tile_finished && !batch_last[using];
    assign drop_list = ends_early && listed && list_tag == batch_tag[using];

    always_comb begin
        if (active)
            cause = issue ? 3'd1 : (looks || tile_finished) ? 3'd4 : 3'd2;
        else if (starts || (ready[using] && stale))
            cause = 3'd4;
        else if (ready[using] && batch_mode[using] != mode)
            cause = 3'd5;
        else
            cause = ready[using] || fetching || listed ? 3'd3 : 3'd0;
    end
    assign idle = !active && ready == 0 && !fetching && !listed && !in_flight && pixels[0] == 0 && pixels[1] == 0;

    always_ff @(posedge clk) begin
        if (!active && ready[using] && !stale && batch_mode[using] != mode && !in_flight)
            mode <= batch_mode[using];
        if (starts) begin
            active <= 1'b1;
            current <= 0;
            todo <= next_groups;
            ended <= 1'b0;
            if (batch_first[using]) begin
                tile <= !tile;
                pixels[!tile] <= 2'd1;
                modes[!tile] <= mode;
            end
        end
        if (issue) todo[group] <= 1'b0;
        if ((looks || (issue && is_last_group)) && !is_last_primitive) begin
            current <= current + 1'b1;
            todo <= next_groups;
        end
        if (drop_half || done_half) begin
            using <= !using;
            active <= 1'b0;
        end
        if (ends_early) begin
            // What is left of the list was fetched in vain.
            ended <= 1'b1;
            ended_tag <= batch_tag[using];
        end
        if (active && (tile_finished || (done_half && batch_last[using])))
            pixels[tile] <= 2'd2;
        if (pixels[leave_tile] == 2 && !in_flight_of_leaving) pixels[leave_tile] <= 2'd3;
        if (leaves) pixels[leave_tile] <= 2'd0;
        if (reset) begin
            active <= 1'b0;
            using <= 1'b0;
            mode <= 1'b1;
            ended <= 1'b0;
            tile <= 1'b1;
            modes <= 2'b11;
            pixels[0] <= 2'd0;
            pixels[1] <= 2'd0;
        end
    end

    // ---- Pixels on their way: operands are in a register; then a place for each cycle.
    always_ff @(posedge clk) begin
        // Nothing of a mode goes any further than its results.
        valid <= {valid[LONGEST-1:0], issue} & (mode ? AS_GAUSSIAN : AS_TRIANGLE);
        places <= {places[5*LONGEST-1:0], tile, group};
        if (reset) valid <= 0;
    end

    // A number of a primitive is used at one place by Gaussians and at another by triangles.
    logic [9*BITS-1:0] numbers0, used;
    always_ff @(posedge clk) numbers0 <= numbers;
    generate
        for (genvar k = 0; k < 9; k = k + 1) begin : operand
            localparam int BY_GAUSSIANS = (k == 2 || k == 4) ? 0 : (k < 4) ? ADD : (k < 8) ? READ + MUL : POWER - ADD;
            localparam int BY_TRIANGLES = (k % 3 == 2) ? MUL + ADD : 0;
            logic [BITS-1:0] of_gaussians, of_triangles;
            delay #(.WIDTH(BITS), .CYCLES(BY_GAUSSIANS)) gaussian (
                .clk(clk), .in(numbers0[k*BITS+:BITS]), .out(of_gaussians));
            delay #(.WIDTH(BITS), .CYCLES(BY_TRIANGLES)) triangle (
                .clk(clk), .in(numbers0[k*BITS+:BITS]), .out(of_triangles));
            assign used[k*BITS+:BITS] = mode ? of_gaussians : of_triangles;
        end
    endgenerate

    // The centres of columns or rows, n and a half: a 5-bit number of halves, normalised.
    function automatic [BITS-1:0] centre(input [3:0] n);
        logic [4:0] halves;
        logic [MANTISSA:0] significand;
        logic [EXPONENT-1:0] exponent;
        begin
            halves = {n, 1'b1};
            significand = 0;
            exponent = 0;
            for (int i = 0; i < 5; i = i + 1)
                if (halves[i]) begin
                    exponent = EXPONENT'((1 << (EXPONENT - 1)) - 2 + i);
                    significand = {{(MANTISSA-4){1'b0}}, halves} << (MANTISSA - i);
                end
            centre = {1'b0, exponent, significand[MANTISSA-1:0]};
        end
    endfunction

    // ---- The PEs and their pixels.
    logic write_color;
    logic [4:0] write_color_at;
    logic [PES*3*BITS-1:0] leaving_colors;
    logic [PES*32-1:0] finished;
    logic [4:0] leave_at;
    logic [1:0] clear;
    assign write_color = mode ? valid[GAUSSIAN] : valid[TRIANGLE];
    assign write_color_at = mode ? places[GAUSSIAN*5+:5] : places[TRIANGLE*5+:5];
    generate
        for (genvar p = 0; p < PES; p = p + 1) begin : lanes
            logic [BITS-1:0] x, y, transmittance, next_transmittance, depth;
            logic [3*BITS-1:0] color, next_color, fragment;
            logic covered, reaches, open, blends, blended, nearer;
            always_ff @(posedge clk) begin
                x <= centre(blocks ? {group[1:0], 2'(p % 4)} : 4'(p));
                y <= centre(blocks ? {group[3:2], 2'(p / 4)} : group);
            end
            pe #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA), .GAUSSIANS(1), .TWO_PATHS(TWO_PATHS), .BOOTH(BOOTH),
                 .POLYNOMIAL(POLYNOMIAL)) element (
                .clk(clk), .mode(mode), .x(x), .y(y), .numbers(used),
                .depth_offset(depth_offset), .depth_scale(depth_scale), .alpha_floor(alpha_floor),
                .alpha_ceiling(alpha_ceiling), .transmittance_floor(transmittance_floor),
                .transmittance(transmittance), .color(color), .fragment(fragment), .covered(covered),
                .reaches(reaches), .open(open), .next_transmittance(next_transmittance), .next_color(next_color));
            delay #(.WIDTH(1), .CYCLES(GAUSSIAN - WRITE)) blend_waits (.clk(clk), .in(blends), .out(blended));
            // A sign and a magnitude compare as integers where signs are alike.
            assign nearer = fragment[3*BITS-1] != depth[BITS-1] ? fragment[3*BITS-1]
                : fragment[3*BITS-1] ? fragment[2*BITS+:BITS-1] > depth[BITS-2:0]
                                     : fragment[2*BITS+:BITS-1] < depth[BITS-2:0];
            pixel_buffer #(.EXPONENT(EXPONENT), .MANTISSA(MANTISSA)) pixels_of_it (
                .clk(clk), .reset(reset), .modes(modes),
                .read_at(places[READ*5+:5]), .color_at(places[(GAUSSIAN-ADD)*5+:5]),
                .transmittance(transmittance), .color(color),
                .write(mode && valid[WRITE]), .write_at(places[WRITE*5+:5]), .reaches(reaches), .open(open),
                .next_transmittance(next_transmittance), .blends(blends),
                .write_color(write_color && (mode ? blended : covered && nearer)), .write_color_at(write_color_at),
                .next_color(mode ? next_color : fragment), .depth(depth),
                .leave_at(leave_at), .leaving(leaving_colors[p*3*BITS+:3*BITS]), .clear(clear),
                .finished(finished[p*32+:32]));
        end
    endgenerate
    always_comb begin
        finished_groups = 16'hffff;
        for (int p = 0; p < PES; p = p + 1)
            finished_groups = finished_groups & finished[p*32+tile*16+:16];
    end

    // ---- Writing: groups, of each the 16 first numbers, then the second and the third ones.
    localparam int PER_BEAT = 128 / BITS;
    localparam int PARTS = PES / PER_BEAT;
    logic leave_tile, in_flight_of_leaving, leaves;
    logic [3:0] leave_group;
    logic [1:0] leave_number, leave_part;
    assign leave_due = pixels[leave_tile] == 3;
    assign leave_at = {leave_tile, leave_group};
    assign write_valid = leave_due && !fetching;
    assign leaving = write_valid;
    assign leaves = write_valid && leave_part == PARTS - 1 && leave_number == 2 && leave_group == 15;
    assign clear = leaves ? (leave_tile ? 2'b10 : 2'b01) : 2'b00;
    always_comb begin
        in_flight_of_leaving = 1'b0;
        for (int i = 0; i <= LONGEST; i = i + 1)
            if (valid[i] && places[i*5+4] == leave_tile && i <= (mode ? GAUSSIAN : TRIANGLE))
                in_flight_of_leaving = 1'b1;
    end
    always_comb begin
        write_data = 0;
        for (int k = 0; k < PER_BEAT; k = k + 1)
            write_data[k*BITS+:BITS] =
                leaving_colors[((leave_part * PER_BEAT + k) * 3 + leave_number) * BITS +: BITS];
    end
    always_ff @(posedge clk) begin
        if (write_valid) begin
            if (leave_part == PARTS - 1) begin
                leave_part <= 0;
                if (leave_number == 2) begin
                    leave_number <= 0;
                    leave_group <= leave_group + 1'b1;
                end else
                    leave_number <= leave_number + 1'b1;
            end else
                leave_part <= leave_part + 1'b1;
        end
        if (leaves) leave_tile <= !leave_tile;
        if (reset) begin
            leave_tile <= 1'b0;
            leave_group <= 0;
            leave_number <= 0;
            leave_part <= 0;
        end
    end
endmodule
