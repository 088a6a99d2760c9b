// Properties of the controller of raster_module, which includes this if FORMAL is defined. prove.sh proves them.

// The environment: memory answers with the data that were asked for, and a list has 1 to 20 primitives.
logic [15:0] owed, lacking;
logic data_moves, write_moves;
assign data_moves = data_valid && data_ready;
assign write_moves = write_valid && write_ready;
always_ff @(posedge clk)
    if (reset) owed <= 0;
    else owed <= owed + (request_valid && request_ready ? request_beats : 16'd0) - 16'(data_moves);
always_comb begin
    assume (saturation <= 2);
    assume (tile_count >= 1 && tile_count <= 20);
    if (owed == 0) assume (!data_valid);
end
// What the requested pieces lack.
always_comb begin
    lacking = 0;
    for (int i = 0; i < PIECES; i = i + 1)
        if (asked[i]) lacking = lacking + beats_of(piece_count[i]);
    lacking = lacking - beats;
end

// What was issued in the last CARRIED - 1 cycles, and the cycle before this one.
logic [CARRIED-2:0] issued;
logic [5*(CARRIED-1)-1:0] issued_at;
logic had_reset, was_in_flight, had_mode;
// What the ports carried in the cycle before this one, without moving it.
logic kept_request, kept_write;
logic [31:0] kept_address;
logic [15:0] kept_beats;
logic [7:0] kept_place;
always_ff @(posedge clk) begin
    issued <= reset ? {(CARRIED-1){1'b0}} : {issued[CARRIED-3:0], issue && mode};
    issued_at <= {issued_at[5*(CARRIED-2)-1:0], tile, group};
    had_reset <= reset;
    was_in_flight <= in_flight && !reset;
    had_mode <= mode;
    kept_request <= request_valid && !request_ready && !reset;
    kept_address <= request_address;
    kept_beats <= request_beats;
    kept_write <= write_valid && !write_ready && !reset;
    kept_place <= {leave_group, leave_number, leave_part};
end

always_ff @(posedge clk)
    if (!reset && !had_reset) begin
        // A pixel's transmittance is written before the next Gaussian reads it.
        for (int i = 0; i < CARRIED - 1; i = i + 1)
            if (issue && mode && issued[i]) assert (issued_at[5*i+:5] != {tile, group});
        // The mode changes only while no pixel is in the pipeline.
        if (was_in_flight) assert (mode == had_mode);
        // What memory owes is what the requested pieces lack; data arrive only in a piece that is not in use.
        assert (lacking == owed + (request_valid ? request_beats : 16'd0));
        if (data_moves) assert (asked[filling]);
        assert ((asked & ready) == 0);
        // A port keeps what it carries until it moves.
        if (kept_request) assert (request_valid && request_address == kept_address && request_beats == kept_beats);
        if (kept_write) assert (write_valid && {leave_group, leave_number, leave_part} == kept_place);
        // The port moves data in one direction at a time.
        assert (!(write_moves && data_moves));
        // Pixels are written once their tile is complete, and no other tile is drawn in their place.
        if (write_valid) assert (pixels[leave_tile] == 3);
        if (write_valid && active) assert (tile != leave_tile || pixels[tile] != 1);
        // A tile is drawn at a time, in pixels that are its own.
        assert (!(pixels[0] == 1 && pixels[1] == 1));
        if (active) assert (pixels[tile] == 1);
        if (active) assert (ready[using] && piece_mode[using] == mode);
        if (active) assert ({1'b0, current} < piece_count[using]);
        // Only groups that a primitive names, and that are open, are evaluated.
        if (issue) assert (todo[group] && open_groups[group]);
        if (issue) assert (!tile_finished);
        // What the module says of itself.
        assert ((cause == 1) == issue);
        assert (cause <= 5);
        if (idle) assert (owed == 0 && !active && !in_flight && !write_valid && !request_valid);
    end
