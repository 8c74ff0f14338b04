# Palpate on Debian 12, from the packages that scripts/package makes.
FROM debian:12-slim
COPY build/packages/*.deb /tmp/packages/
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends /tmp/packages/*.deb \
  && rm -rf /tmp/packages /var/lib/apt/lists/*
EXPOSE 8017
ENTRYPOINT ["palpate-runtime"]
CMD ["--help"]
