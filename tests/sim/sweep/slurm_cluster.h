#pragma once

#include <arpa/inet.h>
#include <netdb.h>
#include <pwd.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>

#include "support/process.h"

namespace arex::test {

/// A Slurm of one node, for as long as the test: munged, slurmctld and slurmd in a private folder,
/// as the test's own user, on the address of the host's name, which is loopback wherever that can
/// be had.
class SlurmCluster {
 public:
  explicit SlurmCluster(int max_array_size) {
    find_address();
    write_key();
    write_text(folder_ / "slurm.conf", configuration(max_array_size));
    setenv("SLURM_CONF", (folder_ / "slurm.conf").c_str(), 1);
    for (const char* name : {"state", "spool", "munge", "ctld", "slurmd"}) {
      std::filesystem::create_directory(folder_ / name);
    }
    const std::string root = folder_.path().string();
    munged_ = std::make_unique<Process>(
        "/usr/sbin/munged",
        std::vector<std::string>{
            "--foreground", "--force", "--num-threads=1", "--key-file=" + root + "/munge.key",
            "--socket=" + root + "/munge.socket", "--pid-file=" + root + "/munged.pid",
            "--log-file=" + root + "/munged.log", "--seed-file=" + root + "/munged.seed"},
        folder_ / "munge");
    wait_for_file(folder_ / "munge.socket");
    controller_ = std::make_unique<Process>(
        "/usr/sbin/slurmctld", std::vector<std::string>{"-D", "-f", root + "/slurm.conf"},
        folder_ / "ctld");
    node_ = std::make_unique<Process>("/usr/sbin/slurmd",
                                      std::vector<std::string>{"-D", "-f", root + "/slurm.conf"},
                                      folder_ / "slurmd");
    wait_for_node();
  }
  ~SlurmCluster() {
    for (Process* daemon : {node_.get(), controller_.get(), munged_.get()}) {
      if (!daemon) continue;
      daemon->signal(SIGKILL);
      (void)daemon->wait();
    }
    unsetenv("SLURM_CONF");
  }
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// What the daemons have to say for themselves.
  [[nodiscard]] std::string logs() const {
    std::string text;
    for (const char* file : {"munge/stderr", "ctld/stderr", "slurmd/stderr"}) {
      text += std::string(file) + ":\n" + read_text(folder_ / file);
    }
    return text;
  }

 private:
  // Slurm binds to what the short name of the host stands for. Where that is a network interface, a
  // host name of the test's own keeps it on loopback, if the kernel allows.
  void find_address() {
    if (!resolve() || address_.rfind("127.", 0) != 0) {
      if (unshare(CLONE_NEWUTS) == 0 && sethostname("localhost", 9) == 0) resolve();
    }
    if (address_.empty()) throw std::runtime_error("the host's name has no address");
  }
  bool resolve() {
    std::array<char, 256> name{};
    gethostname(name.data(), name.size() - 1);
    host_ = std::string(name.data()).substr(0, std::string(name.data()).find('.'));
    addrinfo hints{};
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (getaddrinfo(host_.c_str(), nullptr, &hints, &found) != 0) return false;
    sockaddr_in in{};
    std::memcpy(&in, found->ai_addr, sizeof in);
    freeaddrinfo(found);
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &in.sin_addr, text.data(), text.size());
    address_ = text.data();
    return true;
  }
  // A port that nobody listens on.
  [[nodiscard]] int free_port() const {
    const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in in{};
    in.sin_family = AF_INET;
    inet_pton(AF_INET, address_.c_str(), &in.sin_addr);
    socklen_t size = sizeof in;
    sockaddr address{};
    std::memcpy(&address, &in, sizeof in);
    const bool bound =
        bind(descriptor, &address, size) == 0 && getsockname(descriptor, &address, &size) == 0;
    close(descriptor);
    std::memcpy(&in, &address, sizeof in);
    if (!bound) throw std::runtime_error("no free port on " + address_);
    return ntohs(in.sin_port);
  }
  void write_key() const {
    std::random_device device;
    std::string key;
    for (int i = 0; i < 128; ++i) key += static_cast<char>(device());
    write_text(folder_ / "munge.key", key);
    std::filesystem::permissions(folder_ / "munge.key", std::filesystem::perms(0400));
  }
  [[nodiscard]] std::string configuration(int max_array_size) const {
    const std::string root = folder_.path().string();
    const std::string user = getpwuid(getuid())->pw_name;
    return "ClusterName=arex\nSlurmctldHost=" + host_ + "(" + address_ + ")\n" +
           "AuthType=auth/munge\nAuthInfo=socket=" + root + "/munge.socket\n" +
           "SlurmUser=" + user + "\nSlurmdUser=" + user + "\n" +
           "SlurmctldPort=" + std::to_string(free_port()) +
           "\nSlurmdPort=" + std::to_string(free_port()) + "\n" +
           "CommunicationParameters=NoCtldInAddrAny,NoInAddrAny\n" + "StateSaveLocation=" + root +
           "/state\nSlurmdSpoolDir=" + root + "/spool\n" + "SlurmctldPidFile=" + root +
           "/slurmctld.pid\nSlurmdPidFile=" + root + "/slurmd.pid\n" +
           "ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSwitchType=switch/none\n" +
           "MpiDefault=none\nSelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n" +
           "JobAcctGatherType=jobacct_gather/none\n" +
           "AccountingStorageType=accounting_storage/none\n" +
           "MinJobAge=3600\nMaxArraySize=" + std::to_string(max_array_size) + "\n" +
           "SchedulerParameters=sched_interval=1,bf_interval=1\nReturnToService=2\n" +
           "SlurmdParameters=config_overrides\n" + "NodeName=" + host_ + " NodeAddr=" + address_ +
           " CPUs=2 State=UNKNOWN\n" +
           "PartitionName=test Nodes=ALL Default=YES MaxTime=60 State=UP\n";
  }
  static void wait_for_file(const std::filesystem::path& file) {
    for (int i = 0; i < 500 && !std::filesystem::exists(file); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  void wait_for_node() const {
    for (int i = 0; i < 300; ++i) {
      if (run_process("sinfo", {"--noheader", "--format=%T"}).out == "idle\n") return;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    throw std::runtime_error("the cluster does not come up\n" + logs());
  }

  TemporaryFolder folder_;
  std::string host_, address_;
  std::unique_ptr<Process> munged_, controller_, node_;
};

}  // namespace arex::test
