# A student's server: docker build -t labkit .   (with --build-arg EDITION=exam without solutions)
# For JupyterHub's DockerSpawner and KubeSpawner; alone: docker run -p 8888:8888 labkit labkit start workbook --ip 0.0.0.0
FROM python:3.11-slim
ARG EDITION=""
RUN apt-get update && apt-get install -y --no-install-recommends git fonts-dejavu-core && rm -rf /var/lib/apt/lists/*
COPY . /src
RUN pip install --no-cache-dir uv \
 && LABKIT_EDITION=$EDITION uv pip install --system --no-cache --compile-bytecode -c /src/constraints.txt /src jupyterhub nbgitpuller \
 && rm -rf /src
RUN useradd --create-home --uid 1000 student
USER student
WORKDIR /home/student
ENV OMP_NUM_THREADS=1 JUPYTER_PREFER_ENV_PATH=1
CMD ["jupyterhub-singleuser"]
