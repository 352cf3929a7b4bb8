#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/command/keys.h"
#include "platform/os/new_file.h"
#include "platform/os/secret_file.h"
#include "tests/disk/memory_folder.h"
#include "tests/power_cuts/power_cuts.h"

namespace axlecast {
namespace {

// Name and content of the files that an operator sees.
using Files = std::map<std::string, std::string>;

struct Step {
  std::size_t begun = 0;
  std::size_t done = 0;
  Files files;  // afterwards
};

constexpr mode_t kMode = 0640;

class NewFileCheck {
 public:
  NewFileCheck(const CutOrder& order, CutTally& tally) : order_(order), tally_(tally), random_(order.seed) {}

  void Run() {
    std::filesystem::create_directory(live_);
    RecordedDisk disk(live_);
    Plant(disk, order_.fault);
    steps_.push_back({});
    for (int i = 0; i < order_.operations; ++i) {
      Step step{.begun = disk.position(), .files = steps_.back().files};
      const Result<> written = Write(step.files, i);
      if (!written) return tally_.Breach(written.error().text);
      step.done = order_.fault == PlantedFault::kEarlyClaim ? step.begun : disk.position();
      steps_.push_back(std::move(step));
    }
    CutEverywhere(
        disk, order_, memory_.path() + "/cut",
        [&](std::size_t point, const std::string& folder) { return Check(point, folder); }, tally_);
  }

 private:
  // Writes one file as one of the commands does.
  Result<> Write(Files& files, int number) {
    const bool is_key = random_() % 4 == 0;
    const std::string name = (is_key ? "key" : "file") + std::to_string(random_() % 3);
    const std::string content = is_key ? std::string(SigningKey::Generate().FileText()) : Text(number);
    const bool exists = files.contains(name);
    std::string kept;
    NewFile file(live_ + '/' + name, {.mode = kMode});
    if (Result<> appended = file.Append(content); !appended) return appended;
    if (exists && random_() % 2 == 0) {
      kept = name + ".damaged" + std::to_string(number);
      files[kept] = files[name];
    }
    files[name] = content;
    return file.Commit(exists, kept.empty() ? "" : live_ + '/' + kept);
  }
  std::string Text(int number) {
    const std::size_t size = random_() % 3 == 0 ? 0 : random_() % 3'000;
    return std::to_string(number) + ": " + std::string(size, static_cast<char>('a' + random_() % 26));
  }

  std::string Check(std::size_t point, const std::string& folder) {
    std::size_t first = 0;
    std::size_t last = 0;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      if (steps_[i].done <= point) first = i;
      if (steps_[i].begun < point) last = i;
    }
    last = std::max(first, last);
    Files found;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      struct stat status {};
      if (stat(entry.path().c_str(), &status) != 0 || (status.st_mode & 0777U & ~kMode) != 0) {
        return name + " has more rights than it was given";
      }
      if (!steps_.back().files.contains(name)) continue;  // NAME.XXXXXX: never got its name
      std::ifstream file(entry.path(), std::ios::binary);
      found[name].assign(std::istreambuf_iterator<char>(file), {});
      SecretFiles secrets;
      if (name.starts_with("key") && name.find('.') == std::string::npos &&
          !LoadKeyFile(entry.path().string(), secrets)) {
        return name + " is no key";
      }
    }
    // Of the step that was under way: each name as before or as after it; if the name has its new file, the kept one is there.
    const Files& before = steps_[first].files;
    const Files& after = steps_[last].files;
    bool replaced = false;
    bool kept = true;
    for (const auto& [name, content] : after) {
      const auto now = found.find(name);
      const auto old = before.find(name);
      const bool is_after = now != found.end() && now->second == content;
      const bool is_before =
          old == before.end() ? now == found.end() : now != found.end() && now->second == old->second;
      if (!is_before && !is_after) return name + (now == found.end() ? " is missing" : " is a mixture");
      if (name.find('.') != std::string::npos) {
        kept = kept && is_after;
      } else {
        replaced = replaced || !is_before;
      }
    }
    if (replaced && !kept) return "a file was replaced before the former one had its new name";
    return "";
  }

  const CutOrder order_;
  CutTally& tally_;
  const MemoryFolder memory_;
  const std::string live_ = memory_.path() + "/live";
  std::mt19937_64 random_;
  std::vector<Step> steps_;
};

}  // namespace

CutTally CutNewFiles(const CutOrder& order) {
  CutTally tally;
  NewFileCheck(order, tally).Run();
  return tally;
}

}  // namespace axlecast
