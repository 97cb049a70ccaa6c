# A student's server: docker build -t labkit .   (with --build-arg EDITION=exam without solutions)
# For JupyterHub's DockerSpawner and KubeSpawner; alone: docker run -p 8888:8888 labkit labkit start workbook --ip 0.0.0.0
# The wheel is built apart: an image without solutions holds them in no layer.
FROM python:3.11-slim AS wheel
ARG EDITION=""
COPY . /src
RUN LABKIT_EDITION=$EDITION pip wheel --no-cache-dir --no-deps -w /dist /src

FROM python:3.11-slim
RUN apt-get update && apt-get install -y --no-install-recommends git fonts-dejavu-core && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /dist /dist
COPY constraints.txt /dist/
RUN pip install --no-cache-dir uv \
 && uv pip install --system --no-cache --compile-bytecode -c /dist/constraints.txt /dist/*.whl jupyterhub nbgitpuller
RUN useradd --create-home --uid 1000 student
USER student
WORKDIR /home/student
ENV OMP_NUM_THREADS=1 JUPYTER_PREFER_ENV_PATH=1
CMD ["jupyterhub-singleuser"]
