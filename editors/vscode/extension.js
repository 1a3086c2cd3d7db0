// Starts `descry lsp` and lets the editor speak to it.

const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

exports.activate = async function () {
  const command = workspace.getConfiguration("descry").get("command");
  const parts = ["domain.toml", "objects/*.toml", "scenes/*.toml"];
  client = new LanguageClient(
    "descry",
    "descry",
    { command, args: ["lsp"] },
    {
      documentSelector: [
        { scheme: "file", language: "pddl" },
        { scheme: "file", language: "pddl-plan" },
        ...parts.map((part) => ({ scheme: "file", pattern: `**/${part}` })),
      ],
    },
  );
  await client.start();
};

exports.deactivate = function () {
  return client?.stop();
};
