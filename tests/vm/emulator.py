"""The machine that QEMU emulates, and the files with which a guest begins. Used by tests/vm/run and tests/time_guests/run."""

import pathlib
import shutil
import subprocess
import tempfile

import kernel

HERE = pathlib.Path(__file__).resolve().parent


def initramfs(modules, place):
    """What the guest begins with: busybox, the modules, tests/vm/init."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "bin").mkdir()
        (root / "modules").mkdir()
        busybox = shutil.which("busybox")
        if not busybox:
            raise kernel.Unusable("busybox is missing: apt install busybox-static")
        shutil.copy(busybox, root / "bin/busybox")
        shutil.copy(HERE / "init", root / "init")
        for module in modules:
            shutil.copy(module, root / "modules")
        names = "".join(f"{path.relative_to(root)}\n" for path in sorted(root.rglob("*")))
        with open(place, "wb") as file:
            try:
                subprocess.run(["cpio", "--quiet", "-o", "-H", "newc"], input=names.encode(), stdout=file, cwd=root,
                               check=True)
            except FileNotFoundError:
                raise kernel.Unusable("cpio is missing: apt install cpio") from None


def shared_folder(path, tag, readonly=False):
    """A folder of this machine that the guest may mount as `tag`."""
    return ["-virtfs", f"local,path={path},mount_tag={tag},security_model=none,multidevs=remap" + (",readonly=on" if readonly else "")]


def qemu(vmlinux, initrd, cpus, megabytes, kernel_options=""):
    """The command of a guest without acceleration. It has no devices: the caller adds them."""
    if not shutil.which("qemu-system-x86_64"):
        raise kernel.Unusable("qemu-system-x86_64 is missing: apt install --no-install-recommends qemu-system-x86")
    # However this process ends, no guest stays behind.
    return ["setpriv", "--pdeathsig", "KILL", "qemu-system-x86_64", "-accel", "tcg,thread=multi",
            "-cpu", "max", "-smp", str(cpus), "-m", str(megabytes),
            "-nodefaults", "-no-user-config", "-display", "none", "-no-reboot", "-kernel", vmlinux, "-initrd", initrd,
            # A loaded host starves the guest's CPUs: nothing to complain of, and no reason to find that the timer is broken.
            "-append", "console=ttyS0 quiet panic=-1 oops=panic mitigations=off nokaslr tsc=reliable no_timer_check "
                       "rcupdate.rcu_cpu_stall_suppress=1" + kernel_options]
