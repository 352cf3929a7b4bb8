#include "tools/axlecast/fleet/local_server.h"

#include <grp.h>
#include <poll.h>
#include <pwd.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

namespace axlecast {
namespace {

constexpr const char* kPackages = "/usr/lib/postgresql";
constexpr int kOldestServer = 15;
constexpr int kDefaultPort = 5432;  // names the socket
constexpr const char* kOwner = "axlecast";
constexpr int kPollMs = 100;
constexpr int kOrphansMs = 10'000;  // for the processes of a killed server to end

// Returns the version of a text that is a number; else 0.
int Version(const std::string& text) {
  int version = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), version);
  return error == std::errc() && rest == text.data() + text.size() ? version : 0;
}

std::string FirstLine(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

// Returns the newest version that is installed; 0 if no server is installed.
int NewestInstalled() {
  int newest = 0;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(kPackages, ignored)) {
    if (access((entry.path() / "bin/postgres").c_str(), X_OK) != 0) continue;
    newest = std::max(newest, Version(entry.path().filename()));
  }
  return newest;
}

// Returns the processes whose working directory is the folder, as that of every process of a server is.
std::vector<std::string> ProcessesIn(const std::string& folder) {
  std::vector<std::string> processes;
  std::error_code error;
  const auto canonical = std::filesystem::canonical(folder, error);
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    std::error_code hidden;  // processes of other users, and those that have ended
    const std::string name = entry.path().filename();
    if (Version(name) > 0 && std::filesystem::read_symlink(entry.path() / "cwd", hidden) == canonical)
      processes.push_back(name);
  }
  return processes;
}

std::string Quoted(const std::string& text, char quote) {
  std::string quoted(1, quote);
  for (const char character : text) {
    if (character == quote || character == '\\') quoted += '\\';
    quoted += character;
  }
  return quoted + quote;
}

}  // namespace

LocalServer::LocalServer(LocalServerSettings settings)
    : settings_(std::move(settings)), data_(settings_.folder + "/data"), log_path_(settings_.folder + "/log") {}

LocalServer::~LocalServer() = default;  // ChildProcess kills a server that is still there

std::string LocalServer::Connection() const {
  const std::string port = std::to_string(settings_.port == 0 ? kDefaultPort : settings_.port);
  const bool plain = settings_.folder.find_first_of(" '\\") == std::string::npos;
  return "host=" + (plain ? settings_.folder : Quoted(settings_.folder, '\'')) + " port=" + port +
         " user=" + kOwner;
}

std::string LocalServer::SocketPath() const {
  return settings_.folder + "/.s.PGSQL." + std::to_string(settings_.port == 0 ? kDefaultPort : settings_.port);
}

Result<> LocalServer::Start(const StopSignal& stop) {
  if (geteuid() == 0 && settings_.user.empty()) {
    return Failure(
        "PostgreSQL does not run as root: run this as another user, or add --user NAME, and the server runs as "
        "NAME");
  }
  if (geteuid() != 0 && !settings_.user.empty())
    return Failure("only root can run the server as another user: leave out --user");
  for (const auto step : {&LocalServer::FindPrograms, &LocalServer::PrepareFolder}) {
    if (Result<> done = (this->*step)(); !done) return done;
  }
  log_ = std::make_unique<ProcessLog>(log_path_);
  if (Result<> created = CreateData(stop); !created) return created;
  if (Result<> removed = RemoveRests(stop); !removed) return removed;
  std::vector<std::string> argv = {programs_ + "/postgres",
                                   "-D",
                                   data_,
                                   "-k",
                                   Quoted(settings_.folder, '"'),
                                   "-p",
                                   std::to_string(settings_.port == 0 ? kDefaultPort : settings_.port)};
  for (const std::string& option : {std::string("listen_addresses=") + (settings_.port == 0 ? "" : "127.0.0.1"),
                                    std::string("unix_socket_permissions=0700")}) {
    argv.insert(argv.end(), {"-c", option});
  }
  return process_.Start(AsUser(std::move(argv)), -1);
}

Result<> LocalServer::FindPrograms() {
  const std::string made_by = FirstLine(data_ + "/PG_VERSION");
  const int version = made_by.empty() ? NewestInstalled() : Version(made_by);
  programs_ = std::string(kPackages) + "/" + std::to_string(version) + "/bin";
  if (version >= kOldestServer && access((programs_ + "/postgres").c_str(), X_OK) == 0) return {};
  if (!made_by.empty()) {
    return Failure(settings_.folder + " was made by PostgreSQL " + made_by +
                   ", which is not installed: apt-get install postgresql-" + made_by +
                   ", or move the data to a newer one (docs/fleet.md, upgrade)");
  }
  return Failure("no PostgreSQL server of version 15 or later is installed: apt-get install postgresql-15");
}

// Only its owner may enter the folder: a user who reaches the socket in it is the owner of the database.
Result<> LocalServer::PrepareFolder() {
  sockaddr_un address{};
  if (SocketPath().size() >= sizeof address.sun_path) {
    return Failure("the path " + settings_.folder + " is too long for a socket in it (" +
                   std::to_string(sizeof address.sun_path - 1) + " bytes): choose a shorter one");
  }
  if (Result<> made = PrepareRunDirectory(settings_.folder); settings_.user.empty() && !made) return made;
  if (!settings_.user.empty()) {
    const passwd* const user = getpwnam(settings_.user.c_str());
    if (user == nullptr) return Failure("there is no user " + settings_.user + ": choose one of /etc/passwd");
    if (Result<> made = MakeFolders(settings_.folder, 0700); !made) return made;
    if (chown(settings_.folder.c_str(), user->pw_uid, user->pw_gid) != 0 ||
        chmod(settings_.folder.c_str(), 0700) != 0) {
      return Failure("cannot give " + settings_.folder + " to " + settings_.user + ": " + std::strerror(errno));
    }
  }
  if (const Result<> locked = lock_.Acquire(settings_.folder + "/up.lock"); !locked) {
    return Failure("another axlecast fleet up uses " + settings_.folder + " (" + locked.error().text +
                   "): end it first");
  }
  return {};
}

// initdb works in another folder, so that data/ is complete whenever it exists: it may be killed.
Result<> LocalServer::CreateData(const StopSignal& stop) {
  std::error_code error;
  if (std::filesystem::exists(data_, error)) return {};
  const std::string fresh = data_ + ".new";
  std::filesystem::remove_all(fresh, error);
  if (error) return Failure("cannot remove " + fresh + ", the rest of an earlier start: " + error.message());
  ChildProcess initdb;
  Result<> started =
      initdb.Start(AsUser({programs_ + "/initdb", "-D", fresh, "-U", kOwner, "-E", "UTF8", "--locale=C.UTF-8",
                           "--auth-local=trust", "--auth-host=scram-sha-256", "--data-checksums"}),
                   -1);
  if (!started) return started;
  std::optional<ChildProcess::End> end;
  std::string last;
  while (!(end = initdb.Reap())) {
    pollfd output{initdb.FileDescriptor(), POLLIN, 0};
    static_cast<void>(poll(&output, 1, kPollMs));
    for (const std::string& line : initdb.ReadLines()) log_->Write(last = line);
    if (stop.Requested()) return Failure("stopped while the data was created; the next start begins again");
  }
  for (const std::string& line : initdb.ReadLines()) log_->Write(last = line);
  if (!end->clean) return Failure("initdb failed (" + end->text + "): " + last + " (" + log_path_ + ")");
  std::filesystem::rename(fresh, data_, error);
  if (error) return Failure("cannot rename " + fresh + ": " + error.message());
  return {};
}

// A killed server leaves processes behind that end soon: until then PostgreSQL refuses to start. And it leaves two files with the number
// of its process, which PostgreSQL takes for a running server if the number is in use: by another process now, or by its own remains
// that its parent has not collected yet.
Result<> LocalServer::RemoveRests(const StopSignal& stop) const {
  std::vector<std::string> users = ProcessesIn(data_);
  for (int waited = 0; !users.empty() && waited < kOrphansMs && !stop.Wait(kPollMs); waited += kPollMs) {
    users = ProcessesIn(data_);
  }
  const std::string pid_file = data_ + "/postmaster.pid";
  if (!users.empty()) {
    const std::string server = FirstLine(pid_file);
    return Failure("a server already runs in " + settings_.folder + " (process " + users.front() +
                   "): end it (kill -INT " + (Version(server) == 0 ? users.front() : server) +
                   "), and start again");
  }
  for (const std::string& path : {pid_file, SocketPath() + ".lock"}) {
    std::error_code error;
    const std::string pid = FirstLine(path);
    if (Version(pid) == 0 || !std::filesystem::exists("/proc/" + pid, error)) continue;
    if (unlink(path.c_str()) != 0 && errno != ENOENT) {
      return Failure("cannot remove " + path + ": " + std::strerror(errno));
    }
  }
  return {};
}

// util-linux's setpriv replaces itself by the program, which so is the child that is signalled.
std::vector<std::string> LocalServer::AsUser(std::vector<std::string> argv) const {
  if (settings_.user.empty()) return argv;
  const passwd* const user = getpwnam(settings_.user.c_str());
  const std::string group = user == nullptr ? settings_.user : std::to_string(user->pw_gid);
  std::vector<std::string> as_user = {"/usr/bin/setpriv", "--reuid=" + settings_.user, "--regid=" + group,
                                      "--init-groups",    "--pdeathsig=KILL",          "--"};
  as_user.insert(as_user.end(), argv.begin(), argv.end());
  return as_user;
}

void LocalServer::CopyLog() {
  for (const std::string& line : process_.ReadLines()) log_->Write(last_line_ = line);
}

Result<> LocalServer::Poll() {
  pollfd output{process_.FileDescriptor(), POLLIN, 0};
  static_cast<void>(poll(&output, 1, kPollMs));
  CopyLog();
  const auto end = process_.Reap();
  if (!end) return {};
  CopyLog();
  return Failure("the server has ended (" + end->text + "): " + last_line_ + " (" + log_path_ + ")");
}

void LocalServer::Stop(const StopSignal& stop) {
  const int requests = stop.Count();
  bool hurried = false;
  if (process_.running()) process_.Signal(SIGINT);  // fast shutdown
  while (process_.running() && Poll()) {
    if (!hurried && stop.Count() > requests) {
      process_.Signal(SIGQUIT);  // immediate shutdown
      hurried = true;
    }
  }
}

}  // namespace axlecast
