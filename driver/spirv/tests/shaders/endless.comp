// A loop that ends only when the buffer's first word is set.
#version 450
layout(local_size_x = 32) in;
layout(set = 0, binding = 0) buffer Values { uint stop; uint count; } data;
void main() {
    while (data.stop == 0) atomicAdd(data.count, 1);
}
