# Debian packages by purpose, and the function that installs what is missing. Sourced by tools/demo, tools/test and
# tools/campaign. README.md states the purpose of each library in one line.

packages_build="g++ cmake ninja-build pkg-config python3 lowdown libc6-dev linux-libc-dev
  liblcm-dev liblcm-bin libyaml-cpp-dev libspdlog-dev libcli11-dev nlohmann-json3-dev libexpected-dev libsystemd-dev libsodium-dev
  libsqlite3-dev libpq-dev libmodbus-dev libgpiod-dev libmosquitto-dev libwebsockets-dev libcairo2-dev
  zlib1g-dev libzstd-dev libisal-dev fonts-inter python3-fonttools python3-brotli
  libgtest-dev libgmock-dev libbenchmark-dev
  default-jdk-headless liblcm-java libjchart2d-java"
packages_run="iproute2 util-linux"
# tests/vm and tests/time_guests. Their kernel, the package that linux-image-amd64 depends on, is fetched by tests/vm/run and not
# installed; nor is chrony, which tests/chrony/chrony_package.py fetches.
packages_vm="qemu-system-x86 busybox-static cpio kmod can-utils"
# What the tests are compiled with.
packages_test="golang-go clang-14 lld-14 clang-tidy-14 clang-format-14 libclang-rt-14-dev python3-clang-14 libfuse3-dev procps git"
# What they start.
packages_process="libfaketime spin x11-utils build-essential dpkg-dev debhelper dh-python lintian debootstrap mandoc man-db
  bash-completion systemd xvfb xauth imagemagick default-jre libxtst6 libxrender1 fonts-dejavu-core
  sqlite3 zstd openssl postgresql-15 mosquitto mosquitto-clients libnss-wrapper python3-pymodbus python3-serial python3-serial-asyncio python3-nacl
  mbpoll tshark python3-can python3-jsonschema python3-yaml python3-pandas python3-matplotlib python3-zstandard python3-prometheus-client
  chromium chromium-driver prometheus nftables
  $packages_vm"
# What only tools/campaign starts: llvm-cov, and the picture of a soak.
packages_campaign="llvm-14 gnuplot-nox"
# The tests have MCAP's own reader (tests/convert/mcap_reader) and uPlot from npm; Node.js of another origin brings npm along.
# A build without npm is a build without the curves of axlecast web.
command -v npm >/dev/null || packages_test="$packages_test nodejs npm"

# install_missing PACKAGE...: quiet when nothing is missing; fails loudly when apt does. If something is missing, the others are brought up to
# date as well: a library that Debian has repaired meanwhile would be a known vulnerability in our packages.
install_missing() {
  missing=""
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing="$missing $package"
  done
  [ -z "$missing" ] && return 0
  sudo=""
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "needs root or sudo to install:$missing" >&2; return 1; }
    sudo="sudo"
  fi
  echo "== installing:$missing"
  export DEBIAN_FRONTEND=noninteractive
  $sudo apt-get update -q || return 1
  $sudo apt-get install -q -y --no-install-recommends "$@" || { echo "could not install:$missing" >&2; return 1; }
}
