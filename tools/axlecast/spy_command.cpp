#include "tools/axlecast/spy_command.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>

#include "tools/axlecast/config_option.h"
#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/program.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  bool print = false;
};

// The first of the places where the file is; empty when it is nowhere.
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

bool OnPath(const std::string& program) {
  const char* value = std::getenv("PATH");
  std::string path = value == nullptr ? "/usr/bin:/bin" : value;
  path += ':';
  for (std::size_t start = 0, end = 0; (end = path.find(':', start)) != std::string::npos; start = end + 1) {
    if (access((path.substr(start, end - start) + '/' + program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

// What is missing and the line that brings it; empty when nothing is.
std::string Missing(const std::string& types) {
  if (types.empty()) {
    return "lcmtypes_axlecast.jar is missing: build it (ninja lcmtypes_jar; needs default-jdk-headless "
           "liblcm-java)";
  }
  if (!OnPath("java")) return "java is missing: sudo apt-get install default-jre";
  if (Jar("lcm.jar").empty()) return "lcm.jar is missing: sudo apt-get install liblcm-java";
  if (Jar("jchart2d.jar").empty()) return "jchart2d.jar is missing: sudo apt-get install libjchart2d-java";
  return "";
}

// Debian 12's own launcher passes -Xincgc, which Java 17 refuses; hence our own line.
int Spy(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const std::string types = TypesJar();
  if (const std::string missing = Missing(types); !missing.empty()) {
    std::cerr << missing << '\n';
    return kExitBad;
  }
  const std::vector<std::string> argv = {"java", "-Djava.net.preferIPv4Stack=true", "-cp",
                                         Jar("lcm.jar") + ':' + Jar("jchart2d.jar") + ':' + types, "lcm.spy.Spy"};
  if (options.print) {
    std::cout << ShellText({"env", "LCM_DEFAULT_URL=" + machine->lcm.url, "CLASSPATH=" + types}) << ' '
              << ShellText(argv) << '\n';
    return kExitDone;
  }
  if (const char* display = std::getenv("DISPLAY"); display == nullptr || *display == '\0') {
    std::cerr << "lcm-spy opens a window, and DISPLAY is not set: run it on a desktop, with ssh -X, or without a "
                 "screen under Xvfb:\n  sudo apt-get install xvfb xauth default-jre\n  xvfb-run axlecast spy "
              << machine->file << '\n';
    return kExitBad;
  }
  setenv("LCM_DEFAULT_URL", machine->lcm.url.c_str(), 1);
  setenv("CLASSPATH", types.c_str(), 1);
  std::cerr << Become(argv) << '\n';
  return kExitBad;
}

}  // namespace

void AddSpyCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("spy", "Starts lcm-spy, which then shows our channels decoded");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_flag("--print", options->print, "Only show the command");
  command->footer("example: axlecast spy machine.yaml");
  command->callback([options, &exit_code] { exit_code = Spy(*options); });
}

}  // namespace axlecast
