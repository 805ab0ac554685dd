class Standstill < Formula
  desc "Test bench for initial rotor position detection of PMSMs"
  homepage "@HOME@"
  version "@VERSION@"
  license any_of: ["MIT", "Apache-2.0"]

  on_macos do
    on_arm do
      url "@HOME@/releases/download/v@VERSION@/@ARCHIVE:aarch64-apple-darwin@"
      sha256 "@SHA256:aarch64-apple-darwin@"
    end
    on_intel do
      url "@HOME@/releases/download/v@VERSION@/@ARCHIVE:x86_64-apple-darwin@"
      sha256 "@SHA256:x86_64-apple-darwin@"
    end
  end

  on_linux do
    on_arm do
      url "@HOME@/releases/download/v@VERSION@/@ARCHIVE:aarch64-unknown-linux-gnu@"
      sha256 "@SHA256:aarch64-unknown-linux-gnu@"
    end
    on_intel do
      url "@HOME@/releases/download/v@VERSION@/@ARCHIVE:x86_64-unknown-linux-gnu@"
      sha256 "@SHA256:x86_64-unknown-linux-gnu@"
    end
  end

  # The libraries of FMUs are looked for beside the program, so it stays with them.
  def install
    libexec.install "standstill", "fmu-binaries", *Dir["*standstill_fmu.*"]
    bin.write_exec_script libexec/"standstill"
    man1.install Dir["man/*"]
    bash_completion.install "completions/standstill.bash" => "standstill"
    zsh_completion.install "completions/standstill.zsh" => "_standstill"
    fish_completion.install "completions/standstill.fish"
  end

  test do
    assert_match version.to_s, shell_output("#{bin}/standstill --version")
    system bin/"standstill", "fmu", "paper-5k5", "-o", "drive.fmu"
  end
end
