#!/usr/bin/python3
"""bare_debian.py DEBS FOLDER: follows docs/fleet.md on a bare Debian 12, as a new user: from apt-get install to the picture of a trip. Needs
root, debootstrap, and the archive that apt uses here. DEBS: folder of the packages (ctest -R '^package.build' writes BUILD/package/debs).
FOLDER/root becomes the Debian; a root that exists is used again.

Every command of the document runs exactly as it is printed there: the script ends if the document does not have it. What it adds is
marked "besides": a bare chroot has neither sudo nor systemd, and no machine."""

import os
import pathlib
import pty
import re
import shutil
import signal
import subprocess
import sys
import time

TREE = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = (TREE / "docs" / "fleet.md").read_text(encoding="utf-8")
sys.path.insert(0, str(TREE / "tests" / "package"))
LIMIT_S = 300
PASSWORD = "only for this test"
MACHINE = """machine: press3
lcm: {url: 'udpm://239.255.76.67:7667?ttl=0', command_url: 'udpm://239.255.76.68:7668?ttl=0'}
bridge: {unsigned_commands: allow}
buses:
  rs485-0:
    family: tformat
    simulate:
      axis1: {speed_rpm: 30}
    devices:
      axis1: {model: ts5669n127, unit: deg}
  motors:
    family: tsubaki_sc
    simulate:
      conveyor: {load_profile: "0:180,10:220,13:480,30:480,35:180,90:180", thermal_s: 300}
    devices:
      conveyor: {address: 1}
"""


def archive():
    """Returns where apt gets Debian 12 from on this host."""
    import base  # pylint: disable=import-outside-toplevel,import-error
    return base.archive()


def step(text):
    print(f"== {text}", flush=True)


class Debian:
    """A chroot. Commands run in the namespace that this process is in."""

    def __init__(self, root):
        self.root = root

    def run(self, command, user="root", limit=LIMIT_S, **options):
        """Runs a shell command and returns its output. A failure ends the script."""
        print(f"{user}$ {command}", flush=True)
        done = subprocess.run(self.words(command, user), capture_output=True, text=True, timeout=limit, check=False, stdin=subprocess.DEVNULL,
                              env=self.environment(user), **options)
        if done.returncode != 0:
            sys.exit(f"exit code {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout + done.stderr

    def attempt(self, command, user):
        """Runs a shell command that may fail, and returns its standard output."""
        return subprocess.run(self.words(command, user), capture_output=True, text=True, timeout=LIMIT_S, check=False, stdin=subprocess.DEVNULL,
                              env=self.environment(user)).stdout

    def start(self, command, user):
        print(f"{user}$ {command} &", flush=True)
        log = open(self.root.parent / f"{re.sub('[^a-z]+', '-', command)[:40]}.log", "w+b")  # pylint: disable=consider-using-with
        process = subprocess.Popen(self.words(f"exec {command}", user), stdout=log, stderr=log, stdin=subprocess.DEVNULL,  # pylint: disable=consider-using-with
                                   env=self.environment(user))
        return process, lambda: pathlib.Path(log.name).read_text(errors="replace")

    def words(self, command, user):
        home = "/root" if user == "root" else f"/home/{user}"
        return ["chroot", f"--userspec={user}", str(self.root), "/bin/sh", "-c", f"cd {home} && {command}"]

    def environment(self, user):
        return {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LANG": "C.UTF-8",
                "HOME": "/root" if user == "root" else f"/home/{user}", "USER": user, "AXLECAST_RUN_DIR": f"/tmp/axlecast-{user}"}

    def documented(self, command, user="me", **options):
        """Runs a command that the document prints."""
        if command not in DOCUMENT:
            sys.exit(f"docs/fleet.md does not have the command: {command}")
        return self.run(command, user, **options)

    def answer(self, command, user, answers):
        """Runs a documented command on a terminal, and gives each answer when it is asked for."""
        if command not in DOCUMENT:
            sys.exit(f"docs/fleet.md does not have the command: {command}")
        print(f"{user}$ {command}", flush=True)
        leader, follower = pty.openpty()
        process = subprocess.Popen(["setsid", "--ctty", *self.words(command, user)], stdin=follower, stdout=follower, stderr=follower,  # pylint: disable=consider-using-with
                                   env={**self.environment(user), "TERM": "dumb"})
        os.close(follower)
        for _ in answers:
            text = b""
            while not text.rstrip().endswith(b":"):
                text += os.read(leader, 1024)
            os.write(leader, answers[0].encode() + b"\n")
        if process.wait(60) != 0:
            sys.exit(f"exit code {process.returncode}")
        os.close(leader)


def until(condition, what, limit=LIMIT_S):
    end = time.monotonic() + limit
    while not (result := condition()):
        if time.monotonic() > end:
            sys.exit(f"not within {limit} s: {what() if callable(what) else what}")
        time.sleep(0.2)
    return result


def install(debian, debs):
    """The only part that needs the network."""
    step("besides: a user with sudo, and the packages in a folder")
    shutil.copy("/etc/resolv.conf", debian.root / "etc/resolv.conf")
    debian.run("apt-get update -qq")
    debian.run("apt-get install -y -qq --no-install-recommends sudo iproute2 procps")
    if not (debian.root / "home/me").exists():
        debian.run("useradd --create-home --shell /bin/bash me")
    (debian.root / "etc/sudoers.d/me").write_text("me ALL=(ALL) NOPASSWD: ALL\n")
    (debian.root / "etc/apt/apt.conf.d/yes").write_text('APT::Get::Assume-Yes "true";\n')  # the answer to apt's question
    for deb in debs.glob("*.deb"):
        shutil.copy(deb, debian.root / "home/me")
    # Without systemd, no package may start a server here.
    policy = debian.root / "usr/sbin/policy-rc.d"
    policy.write_text("#!/bin/sh\nexit 101\n")
    policy.chmod(0o755)
    step("Install the database")
    debian.documented("sudo apt-get install postgresql-15 ./axlecast_*.deb", limit=1200)


def follow(debian):
    step("On a desk")
    process, log = debian.start("axlecast fleet up", "me")
    connection = until(lambda: re.search(r"host=\S+ port=\d+ user=axlecast dbname=axlecast", log()), log)[0]
    debian.run(f"axlecast fleet status --database '{connection}' --json", "me")
    process.send_signal(signal.SIGINT)  # Ctrl-C
    process.wait(60)

    step("On a server that runs already (besides: no systemd starts it here)")
    debian.run("pg_ctlcluster 15 main start")
    debian.documented("sudo -u postgres createdb axlecast")
    debian.documented('sudo -u postgres axlecast fleet init "dbname=axlecast" --writer axlecast_press --reader grafana')
    debian.answer('sudo -u postgres psql -c "\\password axlecast_press"', "me", [PASSWORD, PASSWORD])

    step("Shipping")
    home = debian.root / "home/me"
    example = re.search(r"```yaml\n(recorder:.*?)```", DOCUMENT, re.DOTALL)[1]
    (home / "machine.yaml").write_text(MACHINE + example.replace("host=db1", "host=127.0.0.1").replace(
        "/etc/axlecast/ship.password", "/home/me/ship.password"))
    (home / "ship.password").write_text(PASSWORD + "\n")
    debian.run("chown me /home/me/machine.yaml /home/me/ship.password && chmod 600 /home/me/ship.password")
    debian.run("axlecast check-config machine.yaml", "me")
    machine, log = debian.start("axlecast up machine.yaml", "me")
    picture = home / "trip.svg"

    def has_curves():
        debian.attempt("axlecast trips conveyor --config machine.yaml --svg trip.svg", "me")
        return picture.exists() and re.search("<(polyline|path)", picture.read_text())
    until(has_curves, log)
    print(f"trip.svg: {picture.stat().st_size} bytes")
    database = "--database 'host=127.0.0.1 dbname=axlecast user=axlecast_press' --password-file ship.password"
    until(lambda: '"conveyor"' in debian.attempt(f"axlecast fleet query trips --machine press3 --message --format jsonl {database}", "me"), log)
    print(debian.run(f"axlecast fleet status {database}", "me"))
    machine.terminate()
    machine.wait(60)
    debian.documented("axlecast ship machine.yaml --once")
    for command in ("axlecast fleet query minutes --machine press3 --from -1d --format json",
                    "axlecast fleet query alarms --machine press3 --from -7d --message --format jsonl"):
        if command not in DOCUMENT:
            sys.exit(f"docs/fleet.md does not have the command: {command}")
        debian.run(f"{command} --config machine.yaml", "me")
    debian.run("pg_ctlcluster 15 main stop")


def main():
    debs, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    root = folder / "root"
    if len(sys.argv) > 3:  # in the namespaces below
        return follow(Debian(root))
    folder.mkdir(parents=True, exist_ok=True)
    if not (root / "etc/debian_version").exists():
        step("debootstrap --variant=minbase bookworm")
        subprocess.run(["debootstrap", "--variant=minbase", "bookworm", str(root), archive()], check=True, stdout=subprocess.DEVNULL)
    isolated = TREE / "tests" / "package" / "isolated.sh"
    inside = (f"mount -t proc proc {root}/proc && mount -t devpts -o newinstance,ptmxmode=0666 devpts {root}/dev/pts && "
              f"mount -t tmpfs -o mode=1777 tmpfs {root}/dev/shm && exec {sys.executable} -B {__file__} {debs} {folder} follow")
    (root / "dev/shm").mkdir(exist_ok=True)
    install(Debian(root), debs)
    return subprocess.run([isolated, "sh", "-c", inside], check=True)


if __name__ == "__main__":
    main()
