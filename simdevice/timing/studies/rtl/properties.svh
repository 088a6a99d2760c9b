// Properties of the controller of raster_module, which includes this if FORMAL is defined. prove.sh proves them.

// The environment: memory answers with the data that were asked for, and a list has 1 to 20 primitives.
logic [15:0] owed;
always_ff @(posedge clk)
    if (reset) owed <= 0;
    else if (request_valid) owed <= request_beats;
    else if (data_valid) owed <= owed - 1'b1;
always_comb begin
    assume (saturation <= 2);
    assume (tile_count >= 1 && tile_count <= 20);
    if (owed == 0) assume (!data_valid);
end

// What was issued in the last CARRIED - 1 cycles, and the cycle before this one.
logic [CARRIED-2:0] issued;
logic [5*(CARRIED-1)-1:0] issued_at;
logic had_reset, was_in_flight, had_mode;
always_ff @(posedge clk) begin
    issued <= reset ? {(CARRIED-1){1'b0}} : {issued[CARRIED-3:0], issue && mode};
    issued_at <= {issued_at[5*(CARRIED-2)-1:0], tile, group};
    had_reset <= reset;
    was_in_flight <= in_flight && !reset;
    had_mode <= mode;
end

always_ff @(posedge clk)
    if (!reset && !had_reset) begin
        // A pixel's transmittance is written before the next Gaussian reads it.
        for (int i = 0; i < CARRIED - 1; i = i + 1)
            if (issue && mode && issued[i]) assert (issued_at[5*i+:5] != {tile, group});
        // The mode changes only while no pixel is in the pipeline.
        if (was_in_flight) assert (mode == had_mode);
        // One request at a time; data arrive only in a half that is not in use.
        assert (fetching == (owed != 0));
        if (request_valid) assert (owed == 0);
        if (fetching) assert (!ready[filling]);
        if (fetching) assert (beats_left == owed);
        // The port moves data in one direction at a time.
        assert (!(write_valid && fetching));
        assert (!(write_valid && request_valid));
        // Pixels are written once their tile is complete, and no other tile is drawn in their place.
        if (write_valid) assert (pixels[leave_tile] == 3);
        if (write_valid && active) assert (tile != leave_tile || pixels[tile] != 1);
        // A tile is drawn at a time, in pixels that are its own.
        assert (!(pixels[0] == 1 && pixels[1] == 1));
        if (active) assert (pixels[tile] == 1);
        if (active) assert (ready[using] && batch_mode[using] == mode);
        if (active) assert ({1'b0, current} < batch_count[using]);
        // Only groups that a primitive names, and that are open, are evaluated.
        if (issue) assert (todo[group] && open_groups[group]);
        if (issue) assert (!tile_finished);
        // What the module says of itself.
        assert ((cause == 1) == issue);
        assert (cause <= 5);
        if (idle) assert (!fetching && !active && !in_flight && !write_valid && !request_valid);
    end
