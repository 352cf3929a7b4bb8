#include "tools/axlecast/run/isolation.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>

#include "core/base/text.h"
#include "platform/os/descriptor.h"
#include "platform/os/folder.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

// Returns an address for the fixed-size fields of the kernel's interface requests.
sockaddr InternetAddress(std::uint32_t host_order) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(host_order);
  sockaddr plain{};
  static_assert(sizeof(plain) == sizeof(address));
  std::memcpy(&plain, &address, sizeof(plain));
  return plain;
}

bool WriteFile(const std::string& path, const std::string& text) {
  const Descriptor file(open(path.c_str(), O_WRONLY | O_CLOEXEC));
  return file.valid() && write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

// ip link set lo up multicast on
bool BringLoopbackUp(int socket) {
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING | IFF_MULTICAST;
  return ioctl(socket, SIOCSIFFLAGS, &request) == 0;
}

// ip route add 224.0.0.0/4 dev lo
bool AddMulticastRoute(int socket) {
  char device[] = "lo";
  rtentry route{};
  route.rt_dst = InternetAddress(0xE0000000);
  route.rt_genmask = InternetAddress(0xF0000000);
  route.rt_flags = RTF_UP;
  route.rt_dev = device;
  return ioctl(socket, SIOCADDRT, &route) == 0;
}

}  // namespace

Result<> EnterIsolation() {
  const bool root = geteuid() == 0;
  const std::string user = std::to_string(geteuid());
  const std::string group = std::to_string(getegid());
  if (unshare(CLONE_NEWNET | (root ? 0 : CLONE_NEWUSER)) != 0) {
    return Failure(
        std::string("cannot create a network namespace: ") + std::strerror(errno) +
        (root ? "; in a container, run it with --privileged or --cap-add SYS_ADMIN"
              : "; run it as root (sudo), or allow it with: sudo sysctl kernel.unprivileged_userns_clone=1"));
  }
  // Without a mapping, the user's files would belong to nobody.
  if (!root &&
      !(WriteFile("/proc/self/setgroups", "deny") && WriteFile("/proc/self/uid_map", user + ' ' + user + " 1") &&
        WriteFile("/proc/self/gid_map", group + ' ' + group + " 1"))) {
    return Failure(std::string("cannot map the user into the namespace: ") + std::strerror(errno));
  }
  const Descriptor control(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!control.valid() || !BringLoopbackUp(control.get()) || !AddMulticastRoute(control.get())) {
    return Failure(std::string("cannot set up loopback in the namespace: ") + std::strerror(errno));
  }
  return {};
}

std::vector<std::string> EntryArguments(pid_t process, const std::vector<std::string>& command) {
  std::vector<std::string> line = {"nsenter", "--target", std::to_string(process), "--net"};
  if (geteuid() != 0) line.insert(line.end(), {"--user", "--preserve-credentials"});
  line.insert(line.end(), command.begin(), command.end());
  return line;
}

std::string LoginShell() {
  const char* const shell = std::getenv("SHELL");
  return shell != nullptr && *shell == '/' ? shell : "/bin/sh";
}

namespace {

struct ShellOptions {
  ConfigOption config;
  std::vector<std::string> command;
  bool print = false;
};

// Returns the network namespace of a process; 0 if it is unknown.
ino_t NetworkOf(const std::string& process) {
  struct stat status {};
  return stat(("/proc/" + process + "/ns/net").c_str(), &status) == 0 ? status.st_ino : 0;
}

int Shell(const MachineConfig& machine, const ShellOptions& options) {
  const pid_t process = LockFile::Holder(RunDirectory(machine.machine) + "/up.lock");
  if (process == 0) {
    return Fail("machine " + machine.machine + " is not up for this user: start it with axlecast up --isolated " +
                    machine.file,
                kExitNoAnswer);
  }
  std::vector<std::string> command = options.command.empty() ? std::vector{LoginShell()} : options.command;
  if (const ino_t network = NetworkOf(std::to_string(process)); network != 0 && network != NetworkOf("self")) {
    command = EntryArguments(process, command);
  } else if (options.command.empty() && !options.print) {
    return Fail("machine " + machine.machine + " is up and not isolated: this shell already reaches it", kExitDone);
  }
  if (options.print) {
    std::cout << ShellText(command) << '\n';
    return kExitDone;
  }
  return Fail(Become(command).text, kExitBad);
}

}  // namespace

void AddShellCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ShellOptions>();
  CLI::App* command =
      app.add_subcommand("shell", "Open a shell in the network of a machine that runs with up --isolated");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command
      ->add_option("--run", options->command,
                   "Run this command instead of a shell; all further words are its arguments")
      ->expected(1, 1'000)
      ->type_name("COMMAND...");
  command->add_flag("--print", options->print, "Only print the command");
  command->footer(
      "examples:\n"
      "  axlecast shell config/demo.yaml\n"
      "  axlecast shell config/demo.yaml --run lcm-logger demo.lcm");
  RunOnMachine<ShellOptions>(*command, options, exit_code, &Shell);
}

}  // namespace axlecast
