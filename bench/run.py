#!/usr/bin/env python3
"""Measures the driver against the targets of bench/README.md, side by side with its bare peers.

Started by bench/run. Each ratio comes from pairs that are measured one right after the other, every second pair in the
other order; it is the median of the pairs' ratios. Timing never fails a run: exit code 1 means that something broke."""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import axes_bench
import fleet_queries
import machine  # tests/e2e: how a machine under test is started
import poll_efficiency
import python_bench
import record_bench
import replay_bench
from process_cost import cpu_seconds, resident_mb

TARGETS = ("unpaced", "slots", "latency", "receive", "cpu", "start", "commands", "permits", "decode", "stream", "poll", "guest", "replay", "seek",
           "record", "python", "ticks", "buses", "axes", "fleet")
WARM_UP = 0.25  # s, before CPU time is counted


class Report:
    """One line per target as it is known, and all of them as JSON."""

    def __init__(self):
        self.rows = []
        print(f"{'what':34} {'driver':>14} {'peer':>14} {'ratio (min..max)':>24} {'target':>10}")

    def add(self, what, unit, figure, target, peer=None, ratios=None, at_most=True, judged=None, note=""):
        """Judges the median ratio where there are ratios, else the figure; without a target, neither."""
        value = statistics.median(ratios) if ratios else figure
        if target is None or judged is False:
            verdict = "not judged"
        else:
            verdict = "met" if (value <= target if at_most else value >= target) else "missed"
        self.rows.append({"what": what, "unit": unit, "figure": figure, "peer": peer, "ratios": ratios,
                          "ratio": statistics.median(ratios) if ratios else None, "target": target,
                          "direction": "at most" if at_most else "at least", "verdict": verdict, "note": note})
        spread = f"{value:.3f} ({min(ratios):.3f}..{max(ratios):.3f})" if ratios else ""
        bare = f"{peer:.4g} {unit}" if peer is not None else ""
        bound = "" if target is None else f"{'<=' if at_most else '>='} {target:g}"
        print(f"{what:34} {f'{figure:.4g} {unit}':>14} {bare:>14} {spread:>24} {bound:>10}  {verdict}"
              f"{'; ' + note if note else ''}", flush=True)


def interleaved(pairs, driver, peer):
    """Runs both once per pair, in alternating order: a list of (driver's result, peer's result)."""
    results = []
    for i in range(pairs):
        if i % 2 == 0:
            first = driver()
            results.append((first, peer()))
        else:
            first = peer()
            results.append((driver(), first))
    return results


def median(values):
    return statistics.median(list(values))


class Bench:
    def __init__(self, options, folder, report):
        self.options = options
        self.report = report
        self.folder = pathlib.Path(folder)
        self.run_dir = self.folder / "run"
        os.environ["AXLECAST_RUN_DIR"] = str(self.run_dir)
        os.environ["XDG_STATE_HOME"] = str(self.folder / "state")
        self.programs = pathlib.Path(os.environ["AXLECAST_BENCH"])
        self.url = "udpm://239.255.76.67:7667?ttl=0"
        self.command_url = "udpm://239.255.76.67:7668?ttl=0"
        self.log = open(self.folder / "log", "ab")
        self.processes = []

    # -- processes

    def start(self, *command, **options):
        process = subprocess.Popen([str(word) for word in command], stderr=self.log, **{"stdout": self.log, **options})
        self.processes.append(process)
        return process

    def end(self):
        """Whatever a broken measurement left running."""
        for process in self.processes:
            if process.poll() is None:
                process.kill()
                process.wait()
        self.log.close()

    def said(self):
        return (self.folder / "log").read_text(errors="replace")[-2000:]

    def stop(self, process):
        process.terminate()
        if process.wait(10) not in (0, -15):
            raise RuntimeError(f"{process.args[0]} ended with {process.returncode}:\n{self.said()}")

    def listener(self, program, *arguments):
        process = self.start(self.programs / program, *arguments, stdout=subprocess.PIPE, text=True)
        if process.stdout.readline() != "ready\n":
            raise RuntimeError(f"{program} did not start")
        return process

    def heard(self, listener):
        listener.terminate()
        out, _ = listener.communicate(timeout=20)
        return json.loads(out)

    def machine(self, name, pace, poll_hz, bus="", block="true", device="",
                bridge="bridge: {unsigned_commands: allow}"):
        """The file of one machine, and its running simulator."""
        config = self.folder / f"{name}.yaml"
        config.write_text(f"""machine: {name}
{bridge}
buses:
  rs485-0:
    family: tformat
    poll_hz: {poll_hz}
    {bus}
    simulate: {{axis1: {{{'' if "speed_rpm" in pace else "speed_rpm: 600, "}{pace}}}}}
    devices:
      axis1: {{model: ts5669n127, unit: deg, publish_hz: 1000, block: {block}, permit: not_required{', ' + device if device else ''}}}
""")
        simulator = self.start(machine.BIN / "axlecast", "simulate", config, "--bus", "rs485-0")
        port = self.run_dir / name / "rs485-0.pty"
        machine.wait_for(port.exists, "the simulator's pty")
        return config, simulator, port

    def machine_of_buses(self, title, names, bus, speed_rpm, device=""):
        """The file of a machine with one device on each bus, its running simulators and their ports."""
        config = self.folder / f"{title}.yaml"
        config.write_text(f"machine: {title}\nbridge: {{unsigned_commands: allow}}\nbuses:\n" + "".join(
            f"  bus-{name}: {{family: tformat, {bus}, simulate: {{{name}: {{speed_rpm: {speed_rpm}}}}},\n"
            f"    devices: {{{name}: {{model: ts5669n127{device}}}}}}}\n" for name in names))
        simulators = [self.start(machine.BIN / "axlecast", "simulate", config, "--bus", f"bus-{name}") for name in names]
        ports = [self.run_dir / title / f"bus-{name}.pty" for name in names]
        for port in ports:
            machine.wait_for(port.exists, f"the simulator's {port.name}")
        return config, simulators, ports

    def driver(self, config):
        return self.start(machine.BIN / "axlecast-tformat", "--config", config, "--bus", "rs485-0")

    def run_driver(self, config, *receiver_options, seconds=None):
        """One driver for one pair: what a receiver got, and what the process itself shows."""
        receiver = self.listener("receiver", self.url, *receiver_options)
        started = time.monotonic_ns()
        driver = self.driver(config)
        time.sleep(WARM_UP)
        begin, cpu = time.monotonic(), cpu_seconds(driver.pid)
        time.sleep(seconds or self.options.seconds)
        cpu = (cpu_seconds(driver.pid) - cpu) / (time.monotonic() - begin)
        memory = resident_mb(driver.pid)
        self.stop(driver)
        result = self.heard(receiver)
        if result["positions"] == 0:
            raise RuntimeError(f"the driver published nothing:\n{self.said()}")
        result.update(cpu=cpu, memory_mb=memory, start_ms=(result["first_position_ns"] - started) * 1e-6)
        return result

    def run_bare_loop(self, port, period_us=0):
        receiver = self.listener("receiver", self.url)
        peer = self.start(self.programs / "bare_loop", port, self.url, self.options.seconds, period_us,
                          stdout=subprocess.PIPE, text=True)
        out, _ = peer.communicate(timeout=self.options.seconds + 20)
        result = json.loads(out)
        result.update(cpu=result["cpu_s"] / result["seconds"], receiver=self.heard(receiver))
        return result

    # -- what is measured

    def rate(self, name, pace, what, target):
        config, simulator, port = self.machine(name, pace, 0)
        pairs = interleaved(self.options.pairs, lambda: self.run_driver(config), lambda: self.run_bare_loop(port))
        self.stop(simulator)
        ours = [driver["bus"]["exchanges"] / driver["bus"]["seconds"] for driver, _ in pairs]
        theirs = [peer["exchanges"] / peer["seconds"] for _, peer in pairs]
        self.report.add(what, "/s", median(ours), target, median(theirs), [a / b for a, b in zip(ours, theirs)],
                        at_most=False)
        good = sum(driver["bus"]["good"] for driver, _ in pairs)
        received = sum(driver["samples"] for driver, _ in pairs)
        exchanges = sum(driver["bus"]["exchanges"] for driver, _ in pairs)
        lost = sum(driver["blocks_lost"] for driver, _ in pairs)
        self.report.add("  readings received / good", "", received / good, 1, at_most=False,
                        note=f"{received} of {good} readings, {exchanges} exchanges, {lost} blocks lost")

    def unpaced(self):
        self.rate("unpaced", "pace: unpaced", "exchange rate, unpaced", 0.95)

    def slots(self):
        self.rate("slots", "pace: slots, slot_us: 51", "exchange rate, 51 us slots", 0.95)

    def latency(self):
        config, simulator, _ = self.machine("latency", "pace: wire", 1000, "capture: true", block="false")

        def bare():
            receiver = self.listener("receiver", self.url)
            peer = self.start(self.programs / "bare_publish", self.url, self.options.seconds)
            if peer.wait(self.options.seconds + 20) != 0:
                raise RuntimeError("bare_publish failed")
            return self.heard(receiver)

        pairs = interleaved(self.options.pairs, lambda: self.run_driver(config, "--wire"), bare)
        self.stop(simulator)
        if not all(result["latency"]["n"] for pair in pairs for result in pair):
            raise RuntimeError("no POSITION could be matched with its exchange")
        for key, target in (("p50_us", 1.1), ("p99_us", 1.2)):
            ours = [driver["latency"][key] for driver, _ in pairs]
            theirs = [peer["latency"][key] for _, peer in pairs]
            judged = key == "p50_us" or median(theirs) < 500
            self.report.add(f"last read to subscriber, {key[:3]}", "us", median(ours), target, median(theirs),
                            [a / b for a, b in zip(ours, theirs)], judged=judged,
                            note="" if judged else "the bare p99 is not below 500 us")

    def receive(self):
        """What LcmPort takes to hand a message over, against liblcm; the sender is the same."""
        def through(program):
            receiver = self.listener(program, self.url)
            sender = self.start(self.programs / "bare_publish", self.url, self.options.seconds)
            if sender.wait(self.options.seconds + 20) != 0:
                raise RuntimeError("bare_publish failed")
            seconds = cpu_seconds(receiver.pid)
            return {**self.heard(receiver)["latency"], "cpu_us": seconds * 1e6 / (1000 * self.options.seconds)}

        pairs = interleaved(self.options.pairs, lambda: through("port_receiver"), lambda: through("receiver"))
        for key, what in (("p50_us", "publish to handler, p50"), ("p99_us", "publish to handler, p99"),
                          ("cpu_us", "CPU time of a received message")):
            ours, theirs = [port[key] for port, _ in pairs], [peer[key] for _, peer in pairs]
            judged = key == "p50_us" or (key == "p99_us" and median(theirs) < 500)
            self.report.add(what, "us", median(ours), 1.0 if key == "p50_us" else 1.2 if key == "p99_us" else None,
                            median(theirs), [a / b for a, b in zip(ours, theirs)], judged=judged)

    def cpu(self):
        config, simulator, port = self.machine("cpu", "pace: wire", 1000)
        pairs = interleaved(self.options.pairs, lambda: self.run_driver(config),
                            lambda: self.run_bare_loop(port, 1000))
        self.stop(simulator)
        ours = [driver["cpu"] * 100 for driver, _ in pairs]
        theirs = [peer["cpu"] * 100 for _, peer in pairs]
        self.report.add("CPU at 1 kHz poll and publish", "%", median(ours), 1.2, median(theirs),
                        [a / b for a, b in zip(ours, theirs)])
        self.report.add("resident memory", "MB", max(driver["memory_mb"] for driver, _ in pairs), 12)

    def buses(self, count=100, hz=100):
        """CPU time of many drivers, one for each bus, and of as many bare loops on the same ports."""
        names = [f"axis{i}" for i in range(count)]
        config, simulators, ports = self.machine_of_buses("buses", names, f"poll_hz: {hz}", 60, f", publish_hz: {hz}, block: true")
        seconds = 4 * self.options.seconds

        def cost(command):
            """CPU time per second of all of them, once all have started."""
            running = [self.start(*command(name, port)) for name, port in zip(names, ports)]
            time.sleep(2)
            begin, before = time.monotonic(), sum(cpu_seconds(process.pid) for process in running)
            time.sleep(seconds)
            cpu = (sum(cpu_seconds(process.pid) for process in running) - before) / (time.monotonic() - begin)
            for process in running:
                process.terminate()
            for process in running:
                process.wait(20)
            return cpu

        pairs = interleaved(min(self.options.pairs, 10),
                            lambda: cost(lambda name, _: (machine.BIN / "axlecast-tformat", "--config", config, "--bus", f"bus-{name}")),
                            lambda: cost(lambda _, port: (self.programs / "bare_loop", port, self.url, 3600, 1_000_000 // hz)))
        for simulator in simulators:
            self.stop(simulator)
        self.report.add(f"CPU of {count} buses at {hz} Hz", "%", 100 * median(ours for ours, _ in pairs), 1.3,
                        100 * median(theirs for _, theirs in pairs), [ours / theirs for ours, theirs in pairs])

    def start_time(self):
        config, simulator, _ = self.machine("start", "pace: wire", 1000)
        times = [self.run_driver(config, seconds=0.2)["start_ms"] for _ in range(self.options.pairs)]
        self.stop(simulator)
        self.report.add("process start to first POSITION", "ms", median(times), 100,
                        note=f"{min(times):.1f}..{max(times):.1f} ms; the device answered before")

    def commands(self):
        config, simulator, _ = self.machine("commands", "pace: unpaced", 0)
        bridge = self.start(machine.BIN / "axlecast-bridge", "--config", config)
        driver = self.driver(config)
        status = [str(machine.BIN / "axlecast"), "status", str(config)]
        machine.wait_for(lambda: subprocess.run(status, stdout=self.log, stderr=self.log, check=False).returncode == 0,
                         "the machine online")
        listener = self.listener("acknowledgements", self.command_url)
        for _ in range(5 * self.options.pairs):
            done = subprocess.run([machine.BIN / "axlecast", "do", "axis1", "read_all", "--config", config],
                                  stdout=self.log, stderr=self.log, check=False)
            if done.returncode != 0:
                raise RuntimeError(f"read_all ended with {done.returncode}:\n{self.said()}")
        times = self.heard(listener)
        for process in (driver, bridge, simulator):
            self.stop(process)
        order, command = times["from_order"], times["from_command"]
        self.report.add("COMMAND to the driver's word, p99", "ms", command["p99_us"] * 1e-3, 10,
                        note=f"n {command['n']}, p50 {command['p50_us'] * 1e-3:.2f}, max {command['max_us'] * 1e-3:.2f}"
                             f" ms; of it the driver's part, from DRIVER_COMMAND: p50 {order['p50_us'] * 1e-3:.2f}, "
                             f"p99 {order['p99_us'] * 1e-3:.2f}, max {order['max_us'] * 1e-3:.2f} ms")

        self.added()

    def added(self):
        """What client, bridge and driver add to the device's own time of a command, all signed, while the bus
        is polled at 1 kHz."""
        keys = subprocess.run([machine.BIN / "axlecast", "keygen", "--machine", "added", "--directory", self.folder / "keys",
                               "--json"], stdout=subprocess.PIPE, stderr=self.log, check=True, text=True)
        config, simulator, _ = self.machine("added", "pace: wire, speed_rpm: 0", 1000, bridge=json.loads(keys.stdout)["yaml"],
                                            device="eeprom_writable: [10], timeout_us: 100000")
        bridge = self.start(machine.BIN / "axlecast-bridge", "--config", config)
        driver = self.driver(config)
        status = [str(machine.BIN / "axlecast"), "status", str(config)]
        machine.wait_for(lambda: subprocess.run(status, stdout=self.log, stderr=self.log, check=False).returncode == 0,
                         "the machine online")
        count = 50 * self.options.pairs
        for what, words, target, n in (
                ("eeprom_read", ("eeprom_read", "address=10"), 2, count),
                ("eeprom_write, journalled", ("eeprom_write", "address=10", "data=A1|5E"), 20, min(count, 300))):
            done = subprocess.run([self.programs / "command_times", config, str(n + 1), "axis1", *words],
                                  stdout=subprocess.PIPE, stderr=self.log, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(f"command_times ended with {done.returncode}:\n{self.said()}")
            times = json.loads(done.stdout)
            parts = ", ".join(f"{part} {times[part]['p50_us'] * 1e-3:.2f}/{times[part]['p99_us'] * 1e-3:.2f}"
                              for part in ("accept", "route", "order", "outcome") if part in times)
            self.report.add(f"{what}: added, p50", "ms", times["added"]["p50_us"] * 1e-3, target,
                            judged=None if target == 2 else False,
                            note=f"n {times['added']['n']}, p99 {times['added']['p99_us'] * 1e-3:.2f} ms; total p50 "
                                 f"{times['total']['p50_us'] * 1e-3:.2f}, device p50 {times['device']['p50_us'] * 1e-3:.2f} "
                                 f"ms; parts p50/p99: {parts} ms")
        for process in (driver, bridge, simulator):
            self.stop(process)

    def permits(self):
        """What a control loop of 1 kHz pays in its own thread."""
        key = self.folder / "permits.key"
        subprocess.run([machine.BIN / "axlecast", "keygen", key, "--role", "control"], stdout=self.log, stderr=self.log, check=True)
        done = subprocess.run([self.programs / "permit_cost", key, str(self.options.pairs)], stdout=subprocess.PIPE,
                              stderr=self.log, check=True, text=True)
        times = json.loads(done.stdout)
        for call, target in (("allow", 5), ("withdraw", None)):
            self.report.add(f"permits: {call} in the loop's thread, p99", "us", times[call]["p99_us"], target,
                            note=f"n {times[call]['n']}, p50 {times[call]['p50_us']:.2f}, max {times[call]['max_us']:.1f} us")

    def medians(self, program, figure):
        """A figure of each benchmark in a program."""
        done = subprocess.run([self.programs / program, "--benchmark_format=json",
                               "--benchmark_repetitions=5", "--benchmark_min_time=0.1"], stdout=subprocess.PIPE,
                              stderr=self.log, check=True, text=True)
        runs = json.loads(done.stdout)["benchmarks"]
        for run in runs:
            if run.get("error_occurred"):
                raise RuntimeError(f"{run['name']}: {run['error_message']}")
        return {run["run_name"]: run[figure] for run in runs if run.get("aggregate_name") == "median"}

    def stream(self):
        rates = self.medians("saa_stream_bench", "bytes_per_second")
        for name in (name for name in rates if name.startswith("Parser/")):
            peer = rates[name.replace("Parser/", "NaiveRescan/")]
            case = name.removeprefix("Parser/").replace("damaged_every:", "every ").replace("/", " ")
            self.report.add(f"stream, {case}", "MB/s", rates[name] * 1e-6, 10, peer * 1e-6, at_most=False,
                            note=f"ratio {rates[name] / peer:.2f}")

    def poll(self):
        for case, ideal, seen in poll_efficiency.measure(self, cycles=self.options.pairs):
            self.report.add(f"poll, {case.name}", "s", seen, case.target, ideal, [ideal / seen], at_most=False)

    def replay(self):
        replay_bench.measure(self)

    def seek(self):
        replay_bench.measure_seek(self)

    def record(self):
        record_bench.measure(self)

    def python(self):
        python_bench.measure(self)

    def axes(self):
        axes_bench.measure(self)

    def fleet(self):
        fleet_queries.measure(self.report, 10**7 if self.options.quick else 10**9)

    def guest(self):
        """In QEMU, which has CAN and SPI; only figures of the same run can be compared."""
        source = pathlib.Path(__file__).resolve().parents[1]
        suite = source / "tests/vm/guest/bench_frames.py"
        done = subprocess.run([source / "tests/vm/run", "--build", self.programs.parent, suite], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, check=False)
        figures = [json.loads(line.split("figures: ", 1)[1]) for line in done.stdout.splitlines() if "figures: " in line]
        if done.returncode != 0 or not figures:
            raise RuntimeError(f"tests/vm/run {suite}: {done.stdout[-2000:]}")
        for row in figures:
            if row["what"] == "can":
                self.report.add("CAN, CPU time of a frame", "us", row["driver_cpu_us_per_frame"], 10,
                                row["candump_cpu_us_per_frame"], [row["ratio"]], judged=False)
            print(f"  {row}")
            self.report.rows.append(row)

    def decode(self):
        times = self.medians("decode_bench", "cpu_time")
        for name in ("ParseReply/id3", "ParseReply/id0"):
            self.report.add(f"decoding a frame, {name}", "ns", times.pop(name), 50)
        for name, time in self.medians("frame_bench", "cpu_time").items():
            self.report.add(f"decoding a frame, {name}", "ns", time, 100)
        print("  " + ", ".join(f"{name} {time:.0f} ns" for name, time in times.items()))
        self.report.rows.append({"what": "cost of one reading, no I/O", "unit": "ns", "figures": times})


    # -- several axes on one tick

    def ticks(self):
        for axes in (2, 10):
            self.hull(axes)

    def hull(self, axes, hz=100):
        """The hull of the sampling instants of one tick, of one driver process for each axis and of bare threads, all SCHED_FIFO 80."""
        names = [f"axis{i}" for i in range(axes)]
        config, simulators, ports = self.machine_of_buses(f"ticks{axes}", names, f"poll_hz: {hz}, realtime: {{priority: 80}}", 600)
        seconds = 4 * self.options.seconds

        def drivers():
            running = [self.start(machine.BIN / "axlecast-tformat", "--config", config, "--bus", f"bus-{name}") for name in names]
            time.sleep(1)  # until all of them read
            out = subprocess.run([machine.BIN / "axlecast", "skew", *names, "--config", config, "--seconds", str(seconds), "--json"],
                                 capture_output=True, text=True, check=True, timeout=60).stdout
            for process in running:
                self.stop(process)
            skew = json.loads(out)
            return {**skew["hull_us"], "complete": 1 - skew["incomplete"] / skew["ticks"]}

        def bare():
            out = subprocess.run([self.programs / "bare_ticks", str(seconds), str(1_000_000 // hz), *ports], capture_output=True,
                                 text=True, check=True, timeout=60).stdout
            hull = json.loads(out)["hull"]
            return {"p50": hull["p50_us"], "p99": hull["p99_us"]}

        results = interleaved(self.options.pairs, drivers, bare)
        for share in ("p50", "p99"):
            self.report.add(f"hull of {axes} axes, {share}", "us", median(d[share] for d, _ in results), 1.5, median(b[share] for _, b in results),
                            [d[share] / b[share] for d, b in results])
        self.report.add(f"ticks with all {axes} axes", "%", 100 * median(d["complete"] for d, _ in results), None)
        for simulator in simulators:
            self.stop(simulator)


def main():
    parser = argparse.ArgumentParser(prog="bench/run", description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, help="interleaved pairs for each ratio (20)")
    parser.add_argument("--quick", action="store_true", help="3 pairs of 1 s")
    parser.add_argument("--json", metavar="FILE", help="the figures, every pair's ratio included")
    parser.add_argument("--axes", type=lambda text: [int(word) for word in text.split(",")],
                        help="for axes: their numbers (" + ",".join(map(str, axes_bench.AXES)) + ")")
    parser.add_argument("--axes-hz", type=float, default=100, metavar="HZ", help="for axes: readings per second of each axis (100)")
    parser.add_argument("--only", help="comma-separated: " + ", ".join(TARGETS))
    options = parser.parse_args()
    options.pairs = options.pairs or (3 if options.quick else 20)
    options.seconds = 1.0 if options.quick else 1.5
    wanted = options.only.split(",") if options.only else TARGETS
    if unknown := set(wanted) - set(TARGETS):
        parser.error(f"--only knows no {', '.join(sorted(unknown))}")
    print(f"{options.pairs} pairs of {options.seconds} s; {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; "
          "a ratio is the median of the pairs'")
    report = Report()
    broken = []
    for name in wanted:
        with tempfile.TemporaryDirectory(prefix="axlecast-bench-") as folder:
            bench = Bench(options, folder, report)
            try:
                getattr(bench, "start_time" if name == "start" else name)()
            except (RuntimeError, AssertionError, OSError, subprocess.SubprocessError, json.JSONDecodeError) as error:
                broken.append(name)
                print(f"{name} broke: {error}", flush=True)
            finally:
                bench.end()
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(
            {"pairs": options.pairs, "seconds": options.seconds, "processors": os.cpu_count(),
             "broken": broken, "figures": report.rows}, indent=1) + "\n")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
