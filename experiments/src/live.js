// The page as it is now, in the place of what it was.
async function tell() {
  try {
    const answer = await fetch("/");
    if (!answer.ok) return false;
    const next = new DOMParser().parseFromString(await answer.text(), "text/html");
    const [x, y] = [scrollX, scrollY];
    document.body.replaceChildren(...next.body.childNodes);
    scrollTo(x, y);
    return true;
  } catch { return false; }
}
addEventListener("DOMContentLoaded", () => follow(tell, () => {}));
