// Gives the ports of several modules one memory. Requests, and 16 bytes to write at a time, are taken from the modules in
// turns; memory answers requests in order, and the data go to the module that asked. PORTS is a power of two. Ports are those of
// raster_module, side by side; `write_from` is the module whose data are written.
module arbiter #(
    parameter int PORTS = 4,
    // The most requests in flight, of all modules: a power of two.
    parameter int REQUESTS = 32
) (
    input  logic clk,
    input  logic reset,
    // The modules.
    input  logic [PORTS-1:0] request_valid,
    output logic [PORTS-1:0] request_ready,
    input  logic [PORTS*32-1:0] request_address,
    input  logic [PORTS*16-1:0] request_beats,
    output logic [PORTS-1:0] data_valid,
    input  logic [PORTS-1:0] data_ready,
    input  logic [PORTS-1:0] write_valid,
    output logic [PORTS-1:0] write_ready,
    input  logic [PORTS*128-1:0] write_data,
    // Memory.
    output logic memory_request_valid,
    input  logic memory_request_ready,
    output logic [31:0] memory_request_address,
    output logic [15:0] memory_request_beats,
    input  logic memory_data_valid,
    output logic memory_data_ready,
    output logic memory_write_valid,
    input  logic memory_write_ready,
    output logic [127:0] memory_write_data,
    output logic [$clog2(PORTS)-1:0] write_from
);
    localparam int PORT = $clog2(PORTS);
    localparam int PLACE = $clog2(REQUESTS);

    // ---- Requests, as long as there is room to remember them.
    logic [PORT-1:0] asker;
    logic asks, full, request_moves;
    round_robin #(.PORTS(PORTS)) requests (
        .clk(clk), .reset(reset), .valid(request_valid), .moves(request_moves), .any(asks), .chosen(asker));
    assign memory_request_valid = asks && !full;
    assign memory_request_address = request_address[asker*32+:32];
    assign memory_request_beats = request_beats[asker*16+:16];
    assign request_moves = memory_request_valid && memory_request_ready;
    always_comb begin
        request_ready = 0;
        request_ready[asker] = request_moves;
    end

    // ---- Data, to the module of the oldest request. `last` and `first` are places of requests, and a bit more.
    logic [PORT-1:0] askers [0:REQUESTS-1];
    logic [15:0] beats [0:REQUESTS-1];
    logic [PLACE:0] first, last;
    logic [15:0] moved;
    logic waits, data_moves, answered;
    logic [PORT-1:0] receiver;
    assign waits = first != last;
    assign full = last - first == (PLACE+1)'(REQUESTS);
    assign receiver = askers[first[PLACE-1:0]];
    assign memory_data_ready = waits && data_ready[receiver];
    assign data_moves = memory_data_valid && memory_data_ready;
    assign answered = data_moves && moved + 1'b1 == beats[first[PLACE-1:0]];
    always_comb begin
        data_valid = 0;
        data_valid[receiver] = memory_data_valid && waits;
    end
    always_ff @(posedge clk) begin
        if (request_moves) begin
            askers[last[PLACE-1:0]] <= asker;
            beats[last[PLACE-1:0]] <= memory_request_beats;
            last <= last + 1'b1;
        end
        if (data_moves) moved <= answered ? 16'd0 : moved + 1'b1;
        if (answered) first <= first + 1'b1;
        if (reset) begin
            first <= 0;
            last <= 0;
            moved <= 0;
        end
    end

    // ---- Writes.
    logic write_moves;
    round_robin #(.PORTS(PORTS)) writes (
        .clk(clk), .reset(reset), .valid(write_valid), .moves(write_moves), .any(memory_write_valid), .chosen(write_from));
    assign memory_write_data = write_data[write_from*128+:128];
    assign write_moves = memory_write_valid && memory_write_ready;
    always_comb begin
        write_ready = 0;
        write_ready[write_from] = write_moves;
    end
endmodule
