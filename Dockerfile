# The command and the driver in a small image: docker build -t gaurast . && docker run --rm -v "$PWD:/data" gaurast scene.ply
#
# Programs of images that begin with this one run on the driver: the Vulkan loader finds it without a variable.
FROM debian:bookworm-slim AS build
RUN apt-get update && apt-get install --yes --no-install-recommends ca-certificates curl gcc libc6-dev xz-utils
RUN curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y --profile minimal --default-toolchain 1.95.0
ENV PATH=/root/.cargo/bin:$PATH
COPY . /source
WORKDIR /source
RUN cargo build --locked --profile dist && DESTDIR=/installed PREFIX=/usr driver/package/install.sh target/dist

FROM debian:bookworm-slim
RUN apt-get update && apt-get install --yes --no-install-recommends libvulkan1 && rm -rf /var/lib/apt/lists/*
COPY --from=build /installed /
WORKDIR /data
ENTRYPOINT ["gaurast"]
