# graspproof with its inner loops compiled:
#   docker build -t graspproof . && docker run --rm -v "$PWD:/work" graspproof run wedge
FROM python:3.12-slim-bookworm

RUN apt-get update \
    && apt-get install -y --no-install-recommends libgomp1 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home graspproof

COPY . /source
# pip compiles what it installs; Python's own modules have no bytecode in this image
RUN pip install --no-cache-dir -c /source/.ci/constraints.txt '/source[dataset]' \
    && python -m compileall -q -j 0 -x 'site-packages|/tests?/' \
        "$(python -c 'import sysconfig; print(sysconfig.get_path("stdlib"))')"

USER graspproof
# keeps the compiled loops in the image, so that no container compiles them again
RUN graspproof doctor --compile -q

WORKDIR /work
ENTRYPOINT ["graspproof"]
CMD ["run", "wedge"]
