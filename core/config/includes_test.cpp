#include "core/config/includes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/config/load.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kBus = "{family: point, simulate: true, devices: {";

class Includes : public ::testing::Test {
 protected:
  std::optional<MachineConfig> Load() {
    errors_ = std::make_unique<ConfigErrors>("m.yaml");
    return LoadConfigFrom("m.yaml", read_, *errors_);
  }
  std::string ErrorsOf() {
    EXPECT_FALSE(Load());
    return errors_->Text();
  }
  // The machine that must be good.
  MachineConfig Good() {
    auto machine = Load();
    EXPECT_TRUE(machine) << errors_->Text();
    return machine ? *std::move(machine) : MachineConfig();
  }
  static std::vector<std::string> Files(const MachineConfig& machine) {
    std::vector<std::string> files;
    for (const ConfigSource& source : machine.sources) files.push_back(source.file);
    return files;
  }
  static std::vector<std::string> Buses(const MachineConfig& machine) {
    std::vector<std::string> names;
    for (const BusConfig& bus : machine.buses) names.push_back(bus.name);
    return names;
  }

  std::map<std::string, std::string> files_;
  const ConfigReader read_ = [this](const std::string& file) -> Result<std::string> {
    const auto found = files_.find(file);
    if (found == files_.end()) return Failure("cannot be read: No such file or directory");
    return found->second;
  };
  std::unique_ptr<ConfigErrors> errors_;
};

TEST_F(Includes, MergeTheSectionsOfTheFilesInTheirOrder) {
  files_["m.yaml"] = "machine: hall\ninclude: [cells/a.yaml, b.yaml]\nlcm: {prefix: x_}\n";
  files_["cells/a.yaml"] = "include: [lines.yaml]\nbuses:\n  a0: " + std::string(kBus) + "a: {}}}\n";
  files_["cells/lines.yaml"] = "buses:\n  line0: " + std::string(kBus) + "l: {}}}\n";
  files_["b.yaml"] =
      "buses:\n  b0: " + std::string(kBus) + "b: {}}}\nlcm: {url: 'udpm://239.255.1.1:7000?ttl=0'}\n";
  const MachineConfig machine = Good();
  EXPECT_EQ(machine.machine, "hall");
  EXPECT_EQ(machine.lcm.prefix, "x_");
  EXPECT_EQ(machine.lcm.url, "udpm://239.255.1.1:7000?ttl=0");
  EXPECT_THAT(Buses(machine), ElementsAre("a0", "line0", "b0"));
  EXPECT_THAT(Files(machine), ElementsAre("m.yaml", "cells/a.yaml", "cells/lines.yaml", "b.yaml"));
}

TEST_F(Includes, ABusMayHaveItsDevicesInAnotherFileAndDefaultsApplyToAll) {
  files_["m.yaml"] =
      "machine: hall\ninclude: [axes.yaml]\ndefaults: {point: {poll_hz: 50, devices: {unit: deg}}}\n"
      "buses:\n  line{0..1}:\n    family: point\n    simulate: true\n    devices: {'a{}': {}}\n";
  files_["axes.yaml"] = "defaults: {point: {devices: {direction: cw}}}\nbuses: {'line{0..1}': {capture: true}}\n";
  const MachineConfig machine = Good();
  ASSERT_EQ(machine.buses.size(), 2U);
  for (const BusConfig& bus : machine.buses) {
    EXPECT_TRUE(bus.capture);
    EXPECT_EQ(bus.poll_hz, 50);
    EXPECT_EQ(bus.devices.at(0).direction, -1);
    EXPECT_EQ(bus.devices.at(0).unit, 3);
  }
}

TEST_F(Includes, TheTextIsTheWholeDocumentAndTheSameMachine) {
  files_["m.yaml"] = "machine: hall\ninclude: [a.yaml]\nbuses:\n  b0: " + std::string(kBus) + "b: {}}}\n";
  files_["a.yaml"] = "lcm: &d {prefix: x}\nbuses:\n  a0: " + std::string(kBus) + "a: {<<: *d}}}\n";
  EXPECT_THAT(ErrorsOf(), StartsWith("a.yaml:1:10: buses.a0.devices.a: unknown key 'prefix'"));
  files_["a.yaml"] = "buses:\n  a0: " + std::string(kBus) + "a: {unit: deg}}}\n";
  const MachineConfig machine = Good();
  EXPECT_THAT(machine.text, StartsWith("# m.yaml, a.yaml, as one file\n"));
  ConfigErrors errors("copy.yaml");
  const auto copy = ParseConfig(machine.text, errors);
  ASSERT_TRUE(copy) << errors.Text();
  EXPECT_EQ(Buses(*copy), Buses(machine));
  EXPECT_EQ(copy->FindDevice("a")->config_hash, machine.FindDevice("a")->config_hash);
}

TEST_F(Includes, AFileWithoutThemKeepsItsTextUnchanged) {
  files_["m.yaml"] = "machine: hall # a comment\nbuses: {b0: " + std::string(kBus) + "b: {}}}}\n";
  const MachineConfig machine = Good();
  EXPECT_EQ(machine.text, files_["m.yaml"]);
  EXPECT_TRUE(machine.sources.empty());
}

TEST_F(Includes, AnErrorNamesTheFileAndTheLineThatItIsIn) {
  files_["m.yaml"] = "machine: hall\ninclude: [a.yaml, b.yaml]\nlcm: {prefx: a}\n";
  files_["a.yaml"] = "buses:\n  a0:\n    family: point\n    simulate: true\n    devices: {a: {unit: mn}}\n";
  files_["b.yaml"] = "# one\n# two\nbuses:\n  b0: {family: point, simulate: true, poll: 1, devices: {b: {}}}\n";
  EXPECT_EQ(ErrorsOf(),
            "m.yaml:3:7: lcm: unknown key 'prefx'; did you mean 'prefix'?\n"
            "a.yaml:5:25: buses.a0.devices.a.unit: 'mn' is not one of count, turn, rad, deg, mm, m, um, inch; did "
            "you mean 'mm'?\n"
            "b.yaml:4:39: buses.b0: unknown key 'poll'; did you mean 'poll_hz'?\n");
  EXPECT_EQ(errors_->list()[0].file, "");
  EXPECT_EQ(errors_->list()[1].file, "a.yaml");
  EXPECT_EQ(errors_->list()[1].line, 5);
}

TEST_F(Includes, WhatIsNoYamlIsReportedInItsOwnFile) {
  files_["m.yaml"] = "machine: hall\ninclude: [a.yaml]\n";
  files_["a.yaml"] = "buses:\n\ta0: 1\n";
  EXPECT_THAT(ErrorsOf(), StartsWith("a.yaml:2:"));
  files_["a.yaml"] = "buses:\n  a0: 'open\n";
  EXPECT_THAT(ErrorsOf(), StartsWith("a.yaml:2:7: not YAML: the quote ' that opens here is not closed"));
  files_["a.yaml"] = "buses: 1\nbuses: 2\n";
  EXPECT_EQ(ErrorsOf(), "a.yaml:2:1: key 'buses' is given twice here; the first is in line 1\n");
  files_["a.yaml"] = "";
  EXPECT_THAT(ErrorsOf(), StartsWith("a.yaml: the file is empty"));
  files_["a.yaml"] = "- 1\n";
  EXPECT_THAT(ErrorsOf(), StartsWith("a.yaml:1:1: an included file needs mappings"));
  files_["a.yaml"] = "\xEF\xBB\xBFlcm: {prefx: a}\nbuses: {b0: " + std::string(kBus) + "b: {}}}}\n";
  EXPECT_EQ(ErrorsOf(), "a.yaml:1:7: lcm: unknown key 'prefx'; did you mean 'prefix'?\n");
}

TEST_F(Includes, AKeyInTwoFilesIsAnErrorThatNamesBoth) {
  const std::string bus = "buses:\n  b0: " + std::string(kBus) + "b: {}}}\n";
  files_["m.yaml"] = "machine: hall\ninclude: [a.yaml, b.yaml]\n" + bus;
  files_["a.yaml"] = "machine: other\n";
  files_["b.yaml"] = "\nbuses:\n  b0: {devices: {b: {}}}\nlcm: {prefix: x}\n";
  EXPECT_EQ(ErrorsOf(),
            "a.yaml:1:1: machine: is given here and in line 1 of m.yaml: remove one of the two\n"
            "b.yaml:3:18: buses.b0.devices.b: is given here and in line 4 of m.yaml: remove one of the two\n");
  files_["a.yaml"] = "lcm: {prefix: x}\n";
  files_["b.yaml"] = "\nlcm: {prefix: x}\n";
  EXPECT_EQ(ErrorsOf(), "b.yaml:2:7: lcm.prefix: is given here and in line 1 of a.yaml: remove one of the two\n");
  files_["a.yaml"] = "hosts: {h1: {buses: [b0]}}\n";
  files_["b.yaml"] = "hosts: {h1: {bridge: true}}\n";
  EXPECT_EQ(ErrorsOf(), "b.yaml:1:9: hosts.h1: is given here and in line 1 of a.yaml: remove one of the two\n");
}

TEST_F(Includes, CyclesAreRefused) {
  files_["m.yaml"] = "machine: hall\ninclude:\n  - d/a.yaml\n";
  files_["d/a.yaml"] = "include: [b.yaml]\n";
  files_["d/b.yaml"] = "include: [../d/./a.yaml]\n";
  EXPECT_EQ(ErrorsOf(),
            "d/b.yaml:1:11: include: 'd/a.yaml' includes itself, over 'd/b.yaml': remove one of the two lines\n");
  files_["d/a.yaml"] = "include: [../m.yaml]\n";
  EXPECT_THAT(ErrorsOf(), StartsWith("d/a.yaml:1:11: include: 'm.yaml' includes itself, over 'd/a.yaml'"));
  files_["m.yaml"] = "machine: hall\ninclude: [m.yaml]\n";
  EXPECT_THAT(ErrorsOf(), StartsWith("m.yaml:2:11: include: 'm.yaml' includes itself: remove"));
}

TEST_F(Includes, TheDepthTheNumberAndTheSizeAreLimited) {
  files_["m.yaml"] = "machine: hall\nbuses: {b0: " + std::string(kBus) + "b: {}}}}\ninclude: [1.yaml]\n";
  for (int i = 1; i < 4; ++i)
    files_[std::to_string(i) + ".yaml"] = "include: [" + std::to_string(i + 1) + ".yaml]\n";
  files_["4.yaml"] = "lcm: {prefix: x}\n";
  EXPECT_EQ(Good().lcm.prefix, "x");
  files_["4.yaml"] = "include: [5.yaml]\n";
  EXPECT_EQ(ErrorsOf(),
            "4.yaml:1:11: include: '5.yaml' is nested deeper than 4 files: name it in the machine's file itself\n");
  files_["1.yaml"] = "# " + std::string(kMaxIncluded, '-') + "\nlcm: {prefix: x}\n";
  EXPECT_THAT(ErrorsOf(),
              StartsWith("m.yaml:3:11: include: '1.yaml': the files of this machine have more than 500000"));
  std::string list;
  for (std::size_t i = 0; i <= kMaxIncludedFiles; ++i) {
    const std::string name = std::to_string(i) + ".yaml";
    files_[name] = "{}\n";
    list += "- " + name + '\n';
  }
  files_["m.yaml"] = "machine: hall\nbuses: {b0: " + std::string(kBus) + "b: {}}}}\ninclude:\n" + list;
  EXPECT_EQ(ErrorsOf(), "m.yaml:260:3: include: more than 256 files: join some of them\n");
}

TEST_F(Includes, AFileThatIsMissingOrNamedTwiceIsReportedWhereItIsNamed) {
  files_["conf/m.yaml"] = "machine: hall\ninclude: [none.yaml, a.yaml, ./a.yaml]\n";
  files_["conf/a.yaml"] = "lcm: {}\n";
  ConfigErrors errors("conf/m.yaml");
  EXPECT_FALSE(LoadConfigFrom("conf/m.yaml", read_, errors));
  EXPECT_EQ(errors.Text(),
            "conf/m.yaml:2:11: include: 'conf/none.yaml' cannot be read: No such file or directory: create it, or "
            "correct its name, which counts from the folder of conf/m.yaml\n"
            "conf/m.yaml:2:30: include: 'conf/a.yaml' is included already: name each file once\n");
}

TEST_F(Includes, AMisspeltKeyIsCorrected) {
  files_["m.yaml"] = "machine: hall\ninclud: [a.yaml]\nbuses: {b0: " + std::string(kBus) + "b: {}}}}\n";
  EXPECT_EQ(ErrorsOf(), "m.yaml:2:1: unknown key 'includ'; did you mean 'include'?\n");
}

TEST_F(Includes, NeedAListOfNames) {
  for (const char* list : {"a.yaml", "{}", "[]", "[{}]", "['']", "[\"a\\0b\"]", ""}) {
    files_["m.yaml"] = "machine: hall\ninclude: " + std::string(list) + '\n';
    EXPECT_THAT(ErrorsOf(), HasSubstr("include: needs a list of files")) << list;
  }
}

TEST_F(Includes, ATextWithoutAFileCannotHaveThem) {
  ConfigErrors errors("log");
  EXPECT_FALSE(ParseConfig("machine: hall\ninclude: [a.yaml]\n", errors));
  EXPECT_THAT(errors.Text(), StartsWith("log:2:10: include: only a file can include files"));
}

TEST_F(Includes, SimulatorsHaveTheirKeysAndErrorsFromTheFilesThatWereRead) {
  files_["m.yaml"] = "machine: hall\ninclude: [a.yaml]\n";
  files_["a.yaml"] = "buses:\n  b0:\n    family: point\n    simulate: {speed_rpm: 60}\n    devices: {b: {}}\n";
  MachineConfig machine = Good();
  files_.clear();  // the machine does not depend on them any more
  ConfigErrors errors("m.yaml");
  EXPECT_NE(MakeSimulator(machine, machine.buses[0], errors), nullptr) << errors.Text();
  files_["m.yaml"] = "machine: hall\ninclude: [a.yaml]\n";
  files_["a.yaml"] = "buses:\n  b0:\n    family: point\n    simulate: {sped: 60}\n    devices: {b: {}}\n";
  machine = Good();
  EXPECT_EQ(MakeSimulator(machine, machine.buses[0], *errors_), nullptr);
  EXPECT_THAT(errors_->Text(), StartsWith("a.yaml:4:16: buses.b0.simulate: unknown key 'sped'"));
}

TEST_F(Includes, OnDiskEachFileIsReadWithTheChecksOfTheMachinesFile) {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/m.yaml";
  const std::string axes = folder.path() + "/cells/axes.yaml";
  std::filesystem::create_directory(folder.path() + "/cells");
  std::ofstream(file) << "machine: hall\ninclude: [cells/axes.yaml]\n";
  std::ofstream(axes) << "buses: {b0: " << kBus << "b: {}}}}\n";
  ASSERT_EQ(chmod(file.c_str(), 0644), 0);
  ASSERT_EQ(chmod(axes.c_str(), 0644), 0);
  ConfigErrors good(file);
  const auto machine = LoadConfig(file, good);
  ASSERT_TRUE(machine) << good.Text();
  EXPECT_THAT(Files(*machine), ElementsAre(file, axes));
  ASSERT_EQ(chmod(axes.c_str(), 0666), 0);
  ConfigErrors errors(file);
  EXPECT_FALSE(LoadConfig(file, errors));
  EXPECT_THAT(errors.Text(),
              StartsWith(file + ":2:11: include: '" + axes + "' can be written by every user: who can"));
  ConfigErrors examined(file);
  EXPECT_TRUE(LoadConfig(file, examined, {}, ConfigWriters::kAnyone)) << "axlecast doctor reports it";
}

}  // namespace
}  // namespace axlecast
