# descry without an installation: docker build -t descry . && docker run --rm descry find "cup A"
# Runs and files stay with the caller: docker run --rm -v "$PWD:/work" descry find "cup A" --run runs/cup
# Domains whose calls are Python programs need an image with python3: FROM descry, then apt-get install python3.
FROM rust:1-slim-bookworm AS build
WORKDIR /descry
COPY . .
RUN cargo install --locked --profile dist --path cli --root /out

FROM debian:bookworm-slim
COPY --from=build /out/bin/descry /usr/local/bin/descry
WORKDIR /work
ENTRYPOINT ["descry"]
CMD ["help"]
