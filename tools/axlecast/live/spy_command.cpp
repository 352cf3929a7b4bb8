#include "tools/axlecast/common/subcommands.h"

#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>
#include <system_error>

#include "core/base/result.h"
#include "core/base/text.h"
#include "core/messages/lcm_url.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  bool print = false;
};

// Returns the first place that exists, or an empty text.
std::string FirstExisting(const std::vector<std::string>& places) {
  for (const std::string& place : places) {
    if (access(place.c_str(), R_OK) == 0) return place;
  }
  return "";
}

std::string Jar(const std::string& name) {
  return FirstExisting({"/usr/share/java/" + name, "/usr/local/share/java/" + name});
}

std::string TypesJar() {
  const std::string name = "axlecast/lcmtypes_axlecast.jar";
  return FirstExisting({std::filesystem::path(ProgramFolder()).parent_path().string() + "/share/" + name,
                        "/usr/share/" + name, "/usr/local/share/" + name});
}

// Returns the program's file, found as a shell does, or an empty text.
std::string OnPath(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "/usr/bin:/bin" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string file = folder + '/' + program;
    if (access(file.c_str(), X_OK) == 0) return file;
  }
  return "";
}

// Returns true if this Java cannot open windows: default-jdk-headless, default-jre-headless.
bool IsHeadless(const std::string& java) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::canonical(java, error);
  if (error) return false;
  const std::string libraries = program.parent_path().parent_path().string() + "/lib/";
  return access((libraries + "libawt_headless.so").c_str(), F_OK) == 0 &&
         access((libraries + "libawt_xawt.so").c_str(), F_OK) != 0;
}

// Fails if a file is missing, with the line that installs it.
Result<> CheckInstalled(const std::string& types) {
  if (types.empty()) {
    return Failure(
        "lcmtypes_axlecast.jar is missing: install the package axlecast-java; in a build folder: sudo apt-get "
        "install "
        "default-jdk-headless liblcm-java, then cmake -DAXLECAST_JAVA=ON . && ninja lcmtypes_jar");
  }
  const std::string java = OnPath("java");
  if (java.empty()) return Failure("java is missing: sudo apt-get install default-jre");
  if (IsHeadless(java)) {
    return Failure("the Java of this host (" + java +
                   ") cannot open windows, which lcm-spy needs: sudo apt-get install default-jre");
  }
  if (Jar("lcm.jar").empty()) return Failure("lcm.jar is missing: sudo apt-get install liblcm-java");
  if (Jar("jchart2d.jar").empty()) {
    return Failure("jchart2d.jar is missing: sudo apt-get install libjchart2d-java");
  }
  return {};
}

// Starts Java directly: the launcher of Debian 12 passes -Xincgc, which Java 17 refuses.
int Spy(const MachineConfig& machine, const Options& options) {
  if (const auto url = ParseLcmUrl(machine.lcm.url); url && url->IsIPv6()) {
    return Fail(
        "lcm-spy receives IPv4 groups only, and the machine has " + machine.lcm.url + ": use axlecast watch",
        kExitBad);
  }
  const std::string types = TypesJar();
  if (const auto installed = CheckInstalled(types); !installed) return Fail(installed.error().text, kExitBad);
  const std::vector<std::string> argv = {"java", "-Djava.net.preferIPv4Stack=true", "-cp",
                                         Jar("lcm.jar") + ':' + Jar("jchart2d.jar") + ':' + types, "lcm.spy.Spy"};
  if (options.print) {
    std::cout << ShellText({"env", "LCM_DEFAULT_URL=" + machine.lcm.url, "CLASSPATH=" + types}) << ' '
              << ShellText(argv) << '\n';
    return kExitDone;
  }
  if (const char* display = std::getenv("DISPLAY"); display == nullptr || *display == '\0') {
    std::cerr << "lcm-spy opens a window, and DISPLAY is not set: run it on a desktop, with ssh -X, or without a "
                 "screen under Xvfb:\n  sudo apt-get install xvfb xauth default-jre\n  xvfb-run axlecast spy "
              << machine.file << '\n';
    return kExitBad;
  }
  setenv("LCM_DEFAULT_URL", machine.lcm.url.c_str(), 1);
  setenv("CLASSPATH", types.c_str(), 1);
  return Fail(Become(argv).text, kExitBad);
}

}  // namespace

void AddSpyCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("spy", "Start lcm-spy with the message types of axlecast");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_flag("--print", options->print, "Only print the command");
  command->footer("example: axlecast spy machine.yaml");
  RunOnMachine<Options>(*command, options, exit_code, &Spy);
}

}  // namespace axlecast
