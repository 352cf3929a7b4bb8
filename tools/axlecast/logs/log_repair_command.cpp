#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "platform/os/new_file.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/logs/log_input.h"

namespace axlecast {
namespace {

struct Options {
  std::string file;
  std::string output;
  bool force = false;
};

// A free name for the damaged log: LOG.damaged, else LOG.damaged.2, ...
std::string KeptName(const std::string& file) {
  std::string name = file + ".damaged";
  for (int i = 2; std::filesystem::exists(std::filesystem::symlink_status(name)); ++i) {
    name = file + ".damaged." + std::to_string(i);
  }
  return name;
}

// The stretches between the damage, as they are: numbers and seals stay, so that what is missing can be told.
std::string WriteWhole(NewFile& out, Bytes log, const std::vector<LogReader::Damage>& damage) {
  constexpr std::size_t kPiece = 8U << 20;  // between two steps of the progress
  LogProgress progress("writing", log.size());
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= damage.size(); ++i) {
    const std::size_t end = i < damage.size() ? damage[i].offset : log.size();
    while (begin < end) {
      const Bytes piece = log.subspan(begin, std::min(end - begin, kPiece));
      std::string problem = out.Append(std::string_view(reinterpret_cast<const char*>(piece.data()), piece.size()));
      if (!problem.empty()) return problem;
      progress.At(begin += piece.size());
    }
    if (i < damage.size()) begin = end + damage[i].size;
  }
  return "";
}

// Why the file is not what was read of it any more; else empty.
std::string Changed(const MappedFile& file) {
  if (std::string loss = file.Loss(); !loss.empty()) return loss;
  std::error_code error;
  const auto size = std::filesystem::file_size(file.path(), error);
  return size == file.bytes().size() && !error ? "" : file.path() + " is being written: stop its recorder first";
}

int Run(const Options& options) {
  LogInput input;
  if (!input.Open(options.file)) return kExitBad;
  const MappedFile& file = input.file();
  const Bytes log = input.log();
  input.Read("reading", [](const LogEvent&, std::size_t) { return true; });
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  if (!file.Loss().empty()) return kExitFailed;
  const bool in_place = options.output.empty();
  if (exit_code == kExitDone && in_place) {
    std::cout << options.file << ": " << input.events() << " events, nothing to repair\n";
    return kExitDone;
  }
  NewFile out(in_place ? options.file : options.output, in_place ? file.access() : FileAccess{.mode = file.mode()});
  std::string problem = WriteWhole(out, log, input.damage());
  const std::string kept = in_place ? KeptName(options.file) : "";
  if (std::string changed = Changed(file); !changed.empty()) problem = std::move(changed);
  if (problem.empty()) problem = out.Commit(in_place || options.force, kept);
  if (!problem.empty()) {
    std::cerr << problem << '\n';
    return kExitFailed;
  }
  std::cout << DamageText(options.file, input.damage()) << (in_place ? options.file : options.output) << ": "
            << input.events() << " events; " << DamagedBytes(input.damage()) << " damaged bytes left out"
            << (in_place ? "; as it was: " + kept : "") << '\n';
  return exit_code;
}

}  // namespace

void AddLogRepairCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("repair", "Leaves out what is damaged, so that every reader reads on");
  command->add_option("LOG", options->file, "The log")->required();
  CLI::Option* output =
      command->add_option("--output", options->output, "Write the repaired log there, leave LOG as it is")
          ->type_name("FILE");
  command->add_flag("--force", options->force, "Replaces FILE when it is there already")->needs(output);
  command->footer(
      std::string("Without --output the repaired log takes LOG's place in one step, and the damaged one "
                  "stays as LOG.damaged.\nNothing is changed when there is no damage. Events keep their "
                  "numbers and seals: `axlecast log verify` goes\non telling what is missing.\n"
                  "examples:\n"
                  "  axlecast log repair run.log\n"
                  "  axlecast log repair run.log --output whole.log\n"
                  "Exit code: 0 nothing was damaged, 3 repaired, some bytes are left out, 1 it is no log "
                  "or cannot be read,\n2 usage, 4 the repaired log could not be written.\n"));
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
